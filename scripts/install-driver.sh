#!/usr/bin/env bash
# Makes sure that a Vulkan driver is there: lightgraph renders through Vulkan, on a GPU or, without one, on Mesa's
# software driver (lavapipe). Where a loader and a driver are present it says nothing and changes nothing; otherwise
# it installs Mesa's through apt. With the argument `display` it sees to Xvfb as well, the virtual display on which the
# tests open a window.
set -euo pipefail

loader_present() {
    # ldconfig stands in /sbin, which is not on every user's path. grep reads all of it (no -q): ending early would
    # kill ldconfig by SIGPIPE, and pipefail would call that "absent".
    PATH="$PATH:/sbin:/usr/sbin" ldconfig -p 2>/dev/null | grep 'libvulkan\.so\.1' >/dev/null
}

driver_present() {
    local manifests=${VK_DRIVER_FILES:-${VK_ICD_FILENAMES:-}}
    local manifest directory
    if [ -n "$manifests" ]; then
        # The loader takes these files or folders and no others.
        local -a named
        IFS=: read -ra named <<<"$manifests"
        for manifest in "${named[@]}"; do
            [ -e "$manifest" ] && return 0
        done
        echo "driver: VK_DRIVER_FILES or VK_ICD_FILENAMES names nothing that exists: $manifests" >&2
        echo "        unset it, or set it to a driver's .json manifest" >&2
        exit 1
    fi
    for directory in /usr/share/vulkan/icd.d /usr/local/share/vulkan/icd.d /etc/vulkan/icd.d \
        "${XDG_DATA_HOME:-${HOME:-/root}/.local/share}/vulkan/icd.d"; do
        for manifest in "$directory"/*.json; do
            [ -f "$manifest" ] && return 0
        done
    done
    return 1
}

# On macOS lightgraph uses Metal, which is part of the system.
[ "$(uname -s)" = Linux ] || exit 0

packages=()
missing=()
if ! { loader_present && driver_present; }; then
    packages+=(mesa-vulkan-drivers libvulkan1)
    missing+=("Vulkan loader and driver")
fi
if [ "${1:-}" = display ] && ! command -v Xvfb >/dev/null 2>&1; then
    # The libraries are those that a window loads when it opens.
    packages+=(xvfb libx11-6 libx11-xcb1 libxcursor1 libxi6 libxrandr2 libxkbcommon-x11-0)
    missing+=("virtual display (Xvfb)")
fi
[ ${#missing[@]} -eq 0 ] && exit 0
what=$(IFS=,; echo "${missing[*]}" | sed 's/,/, no /g')

if ! command -v apt-get >/dev/null 2>&1; then
    echo "driver: no $what found, and there is no apt-get to install it with." >&2
    cat >&2 <<'TEXT'
        Install your system's Vulkan loader and Mesa's software driver (lavapipe) or your GPU's own, and for the tests
        Xvfb, for instance
          Fedora:  dnf install vulkan-loader mesa-vulkan-drivers xorg-x11-server-Xvfb
          Arch:    pacman -S vulkan-icd-loader vulkan-swrast xorg-server-xvfb
          Alpine:  apk add vulkan-loader mesa-vulkan-swrast xvfb
        and run this again.
TEXT
    exit 1
fi

as_root=()
if [ "$(id -u)" -ne 0 ]; then
    if ! command -v sudo >/dev/null 2>&1; then
        echo "driver: no $what found; installing needs root. As root, run:" >&2
        echo "          apt-get update && apt-get install ${packages[*]}" >&2
        exit 1
    fi
    as_root=(sudo)
fi

echo "driver: no $what found; installing ${packages[*]} through apt" >&2
log=$(mktemp)
trap 'rm -f "$log"' EXIT
apt() {
    # The ${…+…} keeps bash before 4.4 from calling an empty array unset.
    if ! ${as_root[@]+"${as_root[@]}"} env DEBIAN_FRONTEND=noninteractive apt-get "$@" >"$log" 2>&1; then
        cat "$log" >&2
        echo "driver: apt-get $* failed; what it said stands above" >&2
        exit 1
    fi
}
apt update
apt install --yes --no-install-recommends "${packages[@]}"

if ! { loader_present && driver_present; }; then
    echo "driver: ${packages[*]} are installed, yet no Vulkan loader and driver are found" >&2
    exit 1
fi
echo "driver: installed" >&2
