# Sourced by tools/run and tools/test: the Debian packages that Heddle needs, and their installation.

build_packages=(
  g++
  cmake
  ninja-build
  pkg-config
  git
  libeigen3-dev
  libhdf5-dev
  libtomlplusplus-dev
  libfmt-dev
  nlohmann-json3-dev
  libcli11-dev
  libcairo2-dev
  libsuitesparse-dev
  libopenblas0-pthread
  libcgal-dev
  libtet1.5-dev
  libgmp-dev
  libmpfr-dev
  libjs-three
  calculix-ccx
)

test_packages=(
  libgtest-dev
  libgmock-dev
  libbenchmark-dev
  python3-vtk9
  python3-meshio
  gmsh
)

# install_missing PACKAGE...: installs those that are not there; asks apt for nothing if all are.
install_missing() {
  local package missing=()
  if ! command -v dpkg-query >/dev/null; then
    echo "This is not a Debian system, so nothing is installed; Heddle needs what Debian calls: $*" >&2
    return 0
  fi
  for package in "$@"; do
    [[ $(dpkg-query -W -f='${db:Status-Status}' "$package" 2>/dev/null) == installed ]] || missing+=("$package")
  done
  [[ ${#missing[@]} -gt 0 ]] || return 0

  local as_root=()
  if [[ $(id -u) -ne 0 ]]; then
    if ! command -v sudo >/dev/null; then
      echo "Packages are missing, and they can be installed neither by $(id -un) nor with sudo. As root, run:" >&2
      echo "  apt-get install --no-install-recommends ${missing[*]}" >&2
      return 1
    fi
    as_root=(sudo)
  fi
  echo "Installing: ${missing[*]}"
  "${as_root[@]}" apt-get update -q || echo "going on with the package lists that are there" >&2
  "${as_root[@]}" env DEBIAN_FRONTEND=noninteractive apt-get install -q -y --no-install-recommends "${missing[@]}"
}
