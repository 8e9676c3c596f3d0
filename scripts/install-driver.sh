#!/usr/bin/env bash
# Makes sure that a Vulkan driver is there: lightgraph renders through Vulkan, on a GPU or, without one, on Mesa's
# software driver (lavapipe). Where a loader and a driver are present it says nothing and changes nothing; otherwise
# it installs Mesa's through apt.
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

if loader_present && driver_present; then
    exit 0
fi

packages=(mesa-vulkan-drivers libvulkan1)
if ! command -v apt-get >/dev/null 2>&1; then
    cat >&2 <<'TEXT'
driver: no Vulkan loader and driver were found, and there is no apt-get to install them with.
        Install your system's Vulkan loader and Mesa's software driver (lavapipe), for instance
          Fedora:  dnf install vulkan-loader mesa-vulkan-drivers
          Arch:    pacman -S vulkan-icd-loader vulkan-swrast
          Alpine:  apk add vulkan-loader mesa-vulkan-swrast
        or your GPU's own driver, and run this again.
TEXT
    exit 1
fi

as_root=()
if [ "$(id -u)" -ne 0 ]; then
    if ! command -v sudo >/dev/null 2>&1; then
        echo "driver: no Vulkan loader and driver were found; installing them needs root. As root, run:" >&2
        echo "          apt-get update && apt-get install ${packages[*]}" >&2
        exit 1
    fi
    as_root=(sudo)
fi

echo "driver: no Vulkan loader and driver were found; installing ${packages[*]} (Mesa's software driver) through apt" >&2
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
