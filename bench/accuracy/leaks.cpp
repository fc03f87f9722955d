// SPDX-License-Identifier: Apache-2.0
//
// Points that are inside for certain, rays from them, and what does not come back.
#include "leaks.hpp"

#include <algorithm>
#include <cmath>
#include <limits>
#include <utility>

#include <zkd/query.hpp>

#include "runner.hpp"
#include "scene/closed.hpp"
#include "scene/generate.hpp"
#include "scene/progress.hpp"
#include "scene/random.hpp"
#include "score.hpp"
#include "support/random.hpp"
#include "verify/oracle.hpp"

namespace zkd::bench::accuracy {
namespace {

constexpr std::size_t rays_at_once = std::size_t{1} << 16;
constexpr std::size_t inside_points = 1024;
constexpr std::uint64_t most_rays_of_peers = 10'000'000;

struct ClosedMesh {
  std::string name;
  scene::Mesh mesh;
};

// A cone and its mirror image, joined at the rim; its tips have `n` triangles each.
scene::Mesh double_cone(std::uint32_t n) {
  scene::Mesh mesh = scene::fan(n);  // position 0 is the tip, the rim lies in z = 0
  const glm::vec3 tip = mesh.positions.front();
  const auto other_tip = static_cast<std::uint32_t>(mesh.positions.size());
  mesh.positions.push_back(-tip);
  for (std::uint32_t i = 0; i < n; ++i) {
    const glm::uvec3 face = mesh.faces[i];
    mesh.faces.emplace_back(other_tip, face[2], face[1]);
  }
  return mesh;
}

std::vector<ClosedMesh> closed_meshes(const std::vector<TestScene>& scenes) {
  std::vector<ClosedMesh> meshes;
  meshes.push_back({"sphere of 20,480", scene::sphere(5)});
  meshes.push_back({"sphere of 1,280, radius 1024 at 1e6",
                    scene::offset(scene::scaled(scene::sphere(3), 10), glm::vec3(1e6F))});
  meshes.push_back({"double cone of 2,000 round two vertices", double_cone(1000)});
  scene::Mesh lens = scene::sphere(4);
  for (glm::vec3& p : lens.positions) p.y *= 0x1p-10F;
  meshes.push_back({"sphere of 5,120, flat to 1/1024", std::move(lens)});
  for (const TestScene& scene : scenes) {
    if (scene::is_closed(scene.mesh)) meshes.push_back({scene.name, scene.mesh});
  }
  return meshes;
}

// Inside: an odd number of hits along each of three directions, decided exactly, and none at the
// point itself.
bool is_inside(const verify::Oracle& oracle, const glm::vec3& point, scene::Random& random) {
  for (int i = 0; i < 3; ++i) {
    Ray ray;
    ray.origin = point;
    ray.direction = random.point(-1.0F, 1.0F);
    if (oracle.all_hits(ray).size() % 2 == 0) return false;
    ray.t_max = 0.0F;
    if (oracle.any_hit(ray)) return false;
  }
  return true;
}

std::vector<glm::vec3> points_inside(const scene::Mesh& mesh, const verify::Oracle& oracle,
                                     scene::Random& random) {
  const Box box = scene::bounds(mesh);
  std::vector<glm::vec3> points;
  for (std::size_t tries = 0; tries < 64 * inside_points && points.size() < inside_points;
       ++tries) {
    glm::vec3 point;
    for (int a = 0; a < 3; ++a) point[a] = random.between(box.lo[a], box.hi[a]);
    if (is_inside(oracle, point, random)) points.push_back(point);
  }
  return points;
}

class Aim {
 public:
  Aim(const scene::Mesh& mesh, const std::vector<glm::vec3>& inside, std::uint64_t seed)
      : mesh_(mesh), inside_(inside), random_(seed) {}

  // A ray of each kind in turn.
  std::vector<Ray> rays(std::size_t count) {
    std::vector<Ray> rays(count);
    for (std::size_t i = 0; i < count; ++i) {
      const glm::vec3& from = inside_[random_.below(static_cast<std::uint32_t>(inside_.size()))];
      rays[i].origin = from;
      do {
        rays[i].direction =
            i % target_kinds == 0 ? random_.point(-1.0F, 1.0F) : target(i % target_kinds) - from;
      } while (rays[i].direction == glm::vec3(0.0F));
    }
    return rays;
  }

 private:
  glm::vec3 target(std::size_t kind) {
    const auto face = mesh_.faces[random_.below(static_cast<std::uint32_t>(mesh_.faces.size()))];
    const auto corner = static_cast<int>(random_.below(3));
    glm::vec3 at = mesh_.positions[face[corner]];
    if (kind == 1) {
      const glm::vec3& next = mesh_.positions[face[(corner + 1) % 3]];
      at += random_.unit() * (next - at);
    }
    if (kind == 3) {
      for (int a = 0; a < 3; ++a) at[a] = test::ulps(at[a], random_.integer(-8, 8));
    }
    return at;
  }

  const scene::Mesh& mesh_;
  const std::vector<glm::vec3>& inside_;
  test::Random random_;
};

// Traces a block of rays and, from just behind each hit, what follows it.
// A ray that exact arithmetic lets through too (in the planes of the triangles that it meets) is
// no leak.
void count(Runner& runner, const std::string& mesh, const verify::Oracle& oracle,
           std::span<const Ray> rays, LeaksOf& leaks) {
  std::vector<Hit> hits(rays.size());
  runner.closest_hit(rays, hits);
  std::vector<Ray> onward(rays.begin(), rays.end());
  for (std::size_t i = 0; i < rays.size(); ++i) {
    LeakCounts& counts = leaks.of_target[i % target_kinds];
    ++counts.rays;
    if (hits[i].triangle == no_triangle) {
      if (!oracle.any_hit(rays[i])) continue;
      ++counts.leaks;
      if (leaks.first_leak.empty()) leaks.first_leak = mesh + ": " + describe(rays[i]);
      continue;
    }
    const double t = static_cast<double>(hits[i].t);
    onward[i].t_min = std::nextafter(hits[i].t, std::numeric_limits<float>::infinity());
    onward[i].t_max = static_cast<float>(t + double_hit_ulps * float_ulp(t));
  }
  std::vector<Hit> second(rays.size());
  runner.closest_hit(onward, second);
  for (std::size_t i = 0; i < rays.size(); ++i) {
    if (hits[i].triangle != no_triangle && second[i].triangle != no_triangle) {
      ++leaks.of_target[i % target_kinds].double_hits;
    }
  }
}

LeaksOf& entry(Leaks& leaks, const std::string& name, bool peer, bool watertight) {
  const auto found = std::find_if(leaks.of.begin(), leaks.of.end(),
                                  [&](const LeaksOf& one) { return one.name == name; });
  if (found != leaks.of.end()) return *found;
  leaks.of.push_back({name, peer, watertight, {}, {}});
  return leaks.of.back();
}

}  // namespace

LeakCounts LeaksOf::total() const {
  LeakCounts sum;
  for (const LeakCounts& counts : of_target) {
    sum.rays += counts.rays;
    sum.leaks += counts.leaks;
    sum.double_hits += counts.double_hits;
  }
  return sum;
}

Leaks count_leaks(const std::vector<TestScene>& scenes, std::uint64_t rays, std::uint64_t seed,
                  const cpu::Executor& executor, const Beside& beside) {
  Leaks leaks;
  const std::vector<ClosedMesh> meshes = closed_meshes(scenes);
  const std::uint64_t of_mesh = (rays + meshes.size() - 1) / meshes.size();
  scene::Progress progress("leaks", of_mesh * meshes.size());
  for (std::size_t m = 0; m < meshes.size(); ++m) {
    const ClosedMesh& closed = meshes[m];
    scene::Random random(seed + m);
    const verify::Oracle oracle(closed.mesh.view(), verify::Oracle::Search::box_tree);
    const std::vector<glm::vec3> inside = points_inside(closed.mesh, oracle, random);
    if (inside.empty()) continue;
    leaks.meshes.push_back(closed.name);

    struct Entrant {
      std::string name;
      bool peer;
      bool watertight;
      std::unique_ptr<Runner> runner;
      std::uint64_t rays;  // as many or a block more
    };
    std::vector<Entrant> entrants;
    for (const Setting& setting : all_settings(beside.cuda)) {
      if (!is_intersector_setting(setting)) continue;
      const bool slow = setting.intersector == Intersector::exact;
      // Moeller and Trumbore's test promises no watertightness.
      entrants.push_back({setting.name, false, setting.intersector != Intersector::fast,
                          make_runner(setting, closed.mesh, executor),
                          slow ? std::max<std::uint64_t>(of_mesh / 16, 1) : of_mesh});
    }
    if (beside.peers) {
      for (Peer& peer : make_peers(closed.mesh, executor.threads)) {
        entrants.push_back({peer.name, true, false, std::move(peer.runner),
                            std::min(of_mesh, most_rays_of_peers / meshes.size())});
      }
    }
    for (Entrant& entrant : entrants) entrant.runner->build();

    Aim aim(closed.mesh, inside, random.bits64());
    for (std::uint64_t done = 0; done < of_mesh;) {
      const auto block =
          aim.rays(static_cast<std::size_t>(std::min<std::uint64_t>(rays_at_once, of_mesh - done)));
      for (Entrant& entrant : entrants) {
        if (done >= entrant.rays) continue;
        count(*entrant.runner, closed.name, oracle, block,
              entry(leaks, entrant.name, entrant.peer, entrant.watertight));
      }
      done += block.size();
      progress.advance(block.size());
    }
  }
  return leaks;
}

}  // namespace zkd::bench::accuracy
