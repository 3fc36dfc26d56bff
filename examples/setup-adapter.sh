#!/bin/sh
# Makes sure that there is an adapter that runs core WebGPU. Does nothing where there is one; else installs Mesa's
# software Vulkan driver (lavapipe) through apt-get, as root or with sudo.
set -eu
cd "$(dirname "$0")/.."

# Rust links with the system's C compiler driver, which a bare Debian lacks.
if ! command -v cc >/dev/null 2>&1; then
    needs="gcc libc6-dev"
fi

install_packages() {
    if ! command -v apt-get >/dev/null 2>&1; then
        echo "setup-adapter: please install: $* (this system has no apt-get)" >&2
        exit 1
    fi
    root=""
    if [ "$(id -u)" -ne 0 ]; then
        root="sudo"
    fi
    echo "setup-adapter: installing $*" >&2
    $root apt-get update -qq
    $root env DEBIAN_FRONTEND=noninteractive apt-get install -y -qq --no-install-recommends "$@" >/dev/null
}

if [ -n "${needs:-}" ]; then
    # shellcheck disable=SC2086 # two packages
    install_packages $needs
fi
if cargo run --quiet --release --example adapters >/dev/null 2>&1; then
    exit 0
fi
install_packages mesa-vulkan-drivers libvulkan1
cargo run --quiet --release --example adapters
