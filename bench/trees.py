# SPDX-License-Identifier: Apache-2.0
#
# See bench/trees: runs zkd-bench, and makes tables of its JSON.
import json
import os
import subprocess
import sys

KINDS = ("primary", "diffuse", "shadow")
SCENES = ("bunny", "fairy", "conference", "sibenik", "dragon", "buddha", "sponza", "armadillo")
SIZE = os.environ.get("ZKD_TREES_SIZE", "512")
REPEAT = os.environ.get("ZKD_TREES_REPEAT", "5")
BUILDERS = os.environ.get("ZKD_TREES_BUILDERS", "morton,sah,wu2011")
THREADS = os.environ.get("ZKD_TREES_THREADS", "1,0")


def measure(program, folder, scene, threads):
    command = [
        program, scene, "--backend", "cpu", "--threads", str(threads), "--size", SIZE,
        "--repeat", REPEAT, "--builder", BUILDERS, "--quality", "fast,balanced",
        "--references", "once,budget,all,auto", "--layout", "binary,wide,literal", "--peers", "embree",
        "--json", "-",
    ]
    run = subprocess.run(command, capture_output=True, text=True, check=False)
    if run.returncode != 0:
        sys.exit(f"trees: {' '.join(command)}: {run.stderr.strip()}")
    with open(os.path.join(folder, f"{scene}-{threads}.json"), "w", encoding="utf-8") as file:
        file.write(run.stdout)
    return json.loads(run.stdout)["results"]


def name_of(result):
    options = result["options"]
    if options["layout"] == "literal":
        return "literal poster"
    if options["builder"] != "morton":
        return {"sah": "exact SAH", "wu2011": "Wu et al. 2011"}[options["builder"]]
    asked = result["label"].split(" ")[2]  # what `auto` chose is in the options
    name = {"auto": "automatic", "budget": f"budget {options['budget']:.3g}"}.get(asked, asked)
    return name if options["quality"] == "fast" else "balanced, " + name


def rays_per_second(trace, kinds=KINDS):
    """Millions, over all kinds together."""
    rays = sum(trace[kind]["rays"] for kind in kinds)
    seconds = sum(trace[kind]["ms"]["median"] for kind in kinds) * 1e-3
    return rays / seconds * 1e-6


def table(results):
    exact = {}
    for result in results:
        if name_of(result) == "exact SAH":
            exact[result["options"]["layout"]] = result
    peers = {peer["name"].split(" ", 1)[1]: peer for peer in results[0]["peers"]}
    medium = rays_per_second(peers["medium"]["trace"])
    print("| tree | build ms | refs | SAH / exact | visits, tests: primary | diffuse | shadow "
          "| Mrays/s: binary | wide: primary | diffuse | shadow | of Embree MEDIUM | MB |")
    print("|---|---:|---:|---:|---:|---:|---:|---:|---:|---:|---:|---:|---:|")
    wide_of = {name_of(r): r for r in results if r["options"]["layout"] == "wide"}
    for result in results:
        if result["options"]["layout"] == "wide":
            continue
        wide = wide_of.get(name_of(result))  # the literal walk has no wide form
        costs = [f"{result['trace'][kind]['node_visits_per_ray']:.1f}, "
                 f"{result['trace'][kind]['triangle_tests_per_ray']:.1f}" for kind in KINDS]
        speeds = [f"{wide['trace'][kind]['mrays_per_s']:.2f}" if wide else "" for kind in KINDS]
        of_medium = f"{rays_per_second(wide['trace']) / medium:.2f}" if wide else ""
        tree = result["tree"]
        ratio = tree["sah"] / exact["binary"]["tree"]["sah"]
        megabytes = result["allocated_bytes"]["tree"] / 1e6
        print(f"| {name_of(result)} | {result['build_ms']['median']:.1f} "
              f"| {tree['references'] / result['triangles']:.2f} | {ratio:.2f} "
              f"| {' | '.join(costs)} | {rays_per_second(result['trace']):.2f} "
              f"| {' | '.join(speeds)} | {of_medium} "
              f"| {megabytes:.1f} |")
    for name in ("low", "medium"):
        peer = peers[name]
        speeds = [f"{peer['trace'][kind]['mrays_per_s']:.2f}" for kind in KINDS]
        print(f"| Embree {name.upper()} | {peer['build_ms']['median']:.1f} | | | | | | "
              f"| {' | '.join(speeds)} | {rays_per_second(peer['trace']) / medium:.2f} | |")
    print()


def marks(results, threads):
    """What the project asks of itself, in brackets, and what was measured. Rays go through wide
    trees; making those is not part of a build."""
    peers = {peer["name"].split(" ", 1)[1]: peer for peer in results[0]["peers"]}
    wide = {name_of(r): r for r in results if r["options"]["layout"] == "wide"}
    build = {name_of(r): r["build_ms"]["median"] for r in results
             if r["options"]["layout"] == "binary"}
    speed = {name: rays_per_second(r["trace"]) for name, r in wide.items()}

    def with_rays(name):
        trace = wide[name]["trace"]
        return build[name] + trace["primary"]["ms"]["median"] + trace["shadow"]["ms"]["median"]

    low, medium = (peers[name]["build_ms"]["median"] for name in ("low", "medium"))
    best = min(with_rays("once"), with_rays("all"))
    wu = ""
    if "Wu et al. 2011" in build:
        wu = f"Wu / once {build['Wu et al. 2011'] / build['once']:.1f}; "
    print(f"{threads} thread(s), wide: exact SAH / Embree MEDIUM "
          f"{speed['exact SAH'] / rays_per_second(peers['medium']['trace']):.2f} (0.6); "
          f"once / exact SAH {speed['once'] / speed['exact SAH']:.2f} (0.7); "
          f"balanced, automatic / exact SAH "
          f"{speed['balanced, automatic'] / speed['exact SAH']:.2f} (0.9). "
          f"Build: Embree LOW / once {low / build['once']:.2f} (1); Embree MEDIUM / balanced, "
          f"automatic {medium / build['balanced, automatic']:.2f} (1); all / once "
          f"{build['all'] / build['once']:.1f} (4); "
          f"{wu}automatic, build + primary + shadow, over the better of once and all "
          f"{with_rays('automatic') / best:.2f} (1.1)")
    print()


def main():
    program, folder = sys.argv[1:3]
    os.makedirs(folder, exist_ok=True)
    for scene in sys.argv[3:] or SCENES:
        for threads in (int(number) for number in THREADS.split(",")):
            results = measure(program, folder, scene, threads)
            count = results[0]["threads"]
            print(f"### {scene}, {results[0]['triangles']:,} triangles, {count} thread(s)\n")
            table(results)
            marks(results, count)
            sys.stdout.flush()


main()
