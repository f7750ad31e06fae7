#!/bin/sh
# What `make embedded`, `make arm64` and `make wasm` need: looks for it, installs it where this is Debian and we are root or may become so,
# and otherwise says how.
#
#     tools.sh          for the drive's processors
#     tools.sh arm64    for ARM64
#     tools.sh wasm     for WebAssembly
#
# Exit code 0: everything is there.
if [ "${1:-}" = arm64 ]; then
    packages="g++-aarch64-linux-gnu qemu-user-static"
    have() { command -v qemu-aarch64-static && command -v aarch64-linux-gnu-g++; } >/dev/null 2>&1
elif [ "${1:-}" = wasm ]; then
    packages="emscripten nodejs"
    have() { command -v em++ && command -v "${NODE:-node}"; } >/dev/null 2>&1
    # Another node than Debian's is as good.
    ! command -v "${NODE:-node}" >/dev/null 2>&1 || packages="emscripten"
else
    packages="gcc-arm-none-eabi libstdc++-arm-none-eabi-newlib qemu-system-arm"
    have() {
        command -v qemu-system-arm && command -v arm-none-eabi-g++ &&
            echo '#include <concepts>' | arm-none-eabi-g++ -std=c++20 -ffreestanding -fsyntax-only -x c++ -
    } >/dev/null 2>&1
fi

have && exit 0
if command -v apt-get >/dev/null 2>&1; then
    root=""
    [ "$(id -u)" -eq 0 ] || root="sudo -n"
    if [ -z "$root" ] || $root true 2>/dev/null; then
        echo "installing $packages" >&2
        { $root apt-get update -q && $root env DEBIAN_FRONTEND=noninteractive apt-get install -q -y --no-install-recommends $packages; } \
            >/dev/null 2>&1
        have && exit 0
    fi
fi
echo "the cross compiler and what runs its programs are missing; on Debian: apt install $packages" >&2
exit 1
