#!/bin/sh
# Renders scenes with every preset and compares them with reference images; prints a Markdown table.
#
#   sh examples/measure-accuracy.sh SCENES TRUTH "NAME..." "PRESET..." [render option...]
#
# SCENES holds NAME.glb, TRUTH holds NAME.direct.exr and NAME.indirect.exr of 256 × 256 pixels with at most three
# indirect bounces. Options of render that follow go to every rendering.
set -eu
scenes=$1 truth=$2 names=$3 presets=$4
shift 4
cd "$(dirname "$0")/.."
cargo build --quiet --release --example render --example compare
work=$(mktemp -d)
trap 'rm -rf "$work"' EXIT

field() { sed -n "s/.*\"$1\":\([^,}]*\).*/\1/p" "$work/result.json"; }

echo "| preset | scene | component | finite | relMSE | near edges | interior | energy bias |"
echo "|---|---|---|---|---|---|---|---|"
for preset in $presets; do
    for name in $names; do
        for component in direct indirect; do
            image="$work/image.exr"
            ./target/release/examples/render "$scenes/$name.glb" --preset "$preset" --component "$component" \
                --bounces 3 --width 256 --height 256 --out "$image" "$@" 2>"$work/log" || { cat "$work/log"; exit 1; }
            ./target/release/examples/compare "$image" "$truth/$name.$component.exr" >"$work/result.json"
            LC_ALL=C printf '| %s | %s | %s | %s | %.4f | %.4f | %.4f | %+.2f %% |\n' "$preset" "$name" "$component" \
                "$(field finite)" "$(field relmse)" "$(field relmse_edge)" "$(field relmse_interior)" \
                "$(echo "$(field bias) 100" | awk '{print $1 * $2}')"
        done
    done
done
