# SPDX-License-Identifier: Apache-2.0
# shellcheck shell=bash
#
# Shared by bench/run, tests/run and .ci/run (sourced, bash): installs missing packages, configures
# and builds a preset. Everything it says goes to stderr.
#
#   ZKD_PRESET      which preset of CMakePresets.json (default: cpu)
#   ZKD_NO_INSTALL  set: never install a package, only name what is missing

zkd_root=$(cd "$(dirname "${BASH_SOURCE[0]}")/.." && pwd)
zkd_preset=${ZKD_PRESET:-cpu}
zkd_build=$zkd_root/build/$zkd_preset
zkd_log=$zkd_root/build/$zkd_preset.log

zkd_packages=(
  g++ cmake ninja-build pkg-config zstd
  libglm-dev                               # the library itself
  libtinyobjloader-dev libassimp-dev       # meshes
  libembree-dev                            # the peer that is timed beside zkd
  libopenimageio-dev                       # images
  libgmp-dev libxxhash-dev                 # the exact oracle; the hash of a tree
  libcli11-dev nlohmann-json3-dev          # command line and results
  libgtest-dev                             # tests
  glmark2-data                             # a Stanford Bunny for a machine without scenes
)

case $zkd_preset in  # these need Clang, its sanitizers and its OpenMP
  fuzz | tsan) zkd_packages+=(clang libclang-rt-dev libomp-dev) ;;
esac

zkd_say() { printf 'zkd: %s\n' "$*" >&2; }

# Runs "$@" with its output in the log; shows the last of it when it fails. On a terminal the last
# line of output is shown while it runs.
zkd_logged() {
  local status=0
  if [[ -t 2 ]]; then
    "$@" 2>&1 | tee -a "$zkd_log" |
      awk -v width="$(tput cols 2>/dev/null || echo 80)" \
        '{ printf "\r\033[K%s", substr($0, 1, width - 1); fflush() } END { printf "\r\033[K" }' >&2
    status=${PIPESTATUS[0]}
  else
    "$@" >>"$zkd_log" 2>&1 || status=$?
  fi
  if ((status != 0)); then
    tail -n 60 "$zkd_log" >&2
    zkd_say "failed: $* (all of it in $zkd_log)"
  fi
  return "$status"
}

# "name version" of each of our packages that is installed.
zkd_installed() {
  dpkg-query -W -f '${db:Status-Status} ${Package} ${Version}\n' "${zkd_packages[@]}" 2>/dev/null |
    sed -n 's/^installed //p'
}

# Installs what is missing. Asks apt for nothing when everything is there; where it cannot install,
# it names the packages and goes on: CMake may find them elsewhere, and says what it lacks.
zkd_install_packages() {
  local missing=() package sudo=() installed
  if ! command -v dpkg-query apt-get >/dev/null; then
    zkd_say "no apt here; zkd uses these packages, as Debian names them: ${zkd_packages[*]}"
    return
  fi
  installed=$(zkd_installed | sed 's/ .*//')
  for package in "${zkd_packages[@]}"; do
    grep -qxF -- "$package" <<<"$installed" || missing+=("$package")
  done
  ((${#missing[@]})) || return 0

  if ((EUID != 0)); then
    if command -v sudo >/dev/null && { [[ -t 0 ]] || sudo -n true 2>/dev/null; }; then
      sudo=(sudo)
    else
      ZKD_NO_INSTALL=1
    fi
  fi
  if [[ -n ${ZKD_NO_INSTALL:-} ]]; then
    zkd_say "please install: ${missing[*]}"
    return
  fi
  zkd_say "installing: ${missing[*]}"
  if ! zkd_logged "${sudo[@]}" apt-get update ||
    ! zkd_logged "${sudo[@]}" env DEBIAN_FRONTEND=noninteractive \
      apt-get install -y --no-install-recommends "${missing[@]}"; then
    zkd_say "going on without them"
  fi
}

# Configures if the build folder is new, or our packages have changed (whenever a CMake file has
# changed the build itself configures again). Then builds the targets given, or all.
zkd_make() {
  local generator=() targets=() configure='' packages
  mkdir -p "$zkd_root/build"
  # Of two calls at once on one build folder the second waits for the first.
  exec 9>"$zkd_build.lock"
  if command -v flock >/dev/null && ! flock -n 9; then
    zkd_say "waiting for another build in build/$zkd_preset"
    flock 9
  fi
  : >"$zkd_log"
  zkd_install_packages

  packages=$(zkd_installed || true)
  if [[ -f $zkd_build/CMakeCache.txt ]] &&
    ! grep -qxF "CMAKE_HOME_DIRECTORY:INTERNAL=$zkd_root" "$zkd_build/CMakeCache.txt"; then
    zkd_say "build/$zkd_preset was made for another folder; it is made anew"
    rm -rf "$zkd_build"
  fi
  if [[ ! -f $zkd_build/CMakeCache.txt ]]; then
    command -v ninja >/dev/null && generator=(-G Ninja)
    zkd_say "building into build/$zkd_preset (takes minutes the first time)"
    configure=1
  elif [[ $packages != "$(cat "$zkd_build/packages.txt" 2>/dev/null)" ]]; then
    configure=1
  fi
  if [[ -n $configure ]]; then
    (cd "$zkd_root" && zkd_logged cmake --preset "$zkd_preset" "${generator[@]}") || return
    grep '^zkd: ' "$zkd_log" | tee "$zkd_build/notices.txt" >&2 || true
    printf '%s\n' "$packages" >"$zkd_build/packages.txt"
  fi
  (($# == 0)) || targets=(--target "$@")
  zkd_logged cmake --build "$zkd_build" --parallel "$(nproc)" "${targets[@]}" || {
    cat "$zkd_build/notices.txt" >&2  # what CMake had left out may be why
    return 1
  }
  exec 9>&-
}
