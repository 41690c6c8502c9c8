#!/usr/bin/env bash
# Compares two builds of oslrun in turns: processor time of the process for each additional point, from 64 x 64
# points to a larger grid, on one thread; medians, in nanoseconds. Outputs are computed but not written.
#
# turns.sh OLD NEW [ROUNDS] [PART OF A NAME]     (about three minutes with 3 rounds)
set -eu
root=$(cd "$(dirname "$0")/../../.." && pwd)
cd "$root"
old=$1 new=$2 rounds=${3:-3} part=${4:-}
lib=crates/oslrun/benches/shaders
image=tests/data/textures/tex64.png
TIMEFORMAT='%U %S'

# Milliseconds of processor time of a run.
spent() { { time "$@" >/dev/null 2>&1; } 2>&1 | awk '{ print ($1 + $2) * 1000 }'; }
median() { sort -g | awk '{ all[NR] = $1 } END { print all[int((NR + 1) / 2)] }'; }

echo "| shader | instruction set | old, ns | new, ns | times as fast |"
echo "|---|---|---|---|---|"
while read -r name size file options; do
    case "$name" in *"$part"*) ;; *) continue ;; esac
    for isa in avx2 avx512; do
        "$new" "$file" -g 16x16 --isa $isa >/dev/null 2>&1 || continue
        a=() b=()
        for _ in $(seq "$rounds"); do
            for build in old new; do
                # shellcheck disable=SC2086
                large=$(spent "${!build}" "$file" -g "${size}x$size" --threads 1 --isa $isa $options)
                # shellcheck disable=SC2086
                small=$(spent "${!build}" "$file" -g 64x64 --threads 1 --isa $isa $options)
                one=$(awk "BEGIN { print ($large - $small) * 1e6 / ($size * $size - 4096) }")
                if [ $build = old ]; then a+=("$one"); else b+=("$one"); fi
            done
        done
        x=$(printf '%s\n' "${a[@]}" | median) y=$(printf '%s\n' "${b[@]}" | median)
        awk "BEGIN { printf \"| %s | %s | %.1f | %.1f | %.2f |\n\", \"$name\", \"$isa\", $x, $y, $x / $y }"
    done
done <<LIST
Cobbled,color 2048 osl/Cobbled.osl --outputs resultRGB
Cobbled,mask 2048 osl/Cobbled.osl --outputs resultMask
flakes 2048 osl/flakes.osl --outputs result
sprinkles 2048 tests/data/seeds/sprinkles.repaired.osl --outputs Fac
strips 2048 osl/strips.osl --outputs Fac
nonlinear_noise 2048 osl/nonlinear_noise.osl -p type=recursive
chaosmosaic 768 osl/chaosmosaic.osl -p Image=$image
matrices 1024 $lib/matrices.osl
transcendental 2048 $lib/transcendental.osl
branches 2048 $lib/branches.osl
splines 1024 $lib/splines.osl
colors 1024 $lib/colors.osl
gabor 256 $lib/gabor.osl
textures 256 $lib/textures.osl -p image=$image
derivatives 2048 $lib/derivatives.osl
strings 768 $lib/strings.osl
loops 256 $lib/loops.osl
loops,short 512 $lib/loops.osl -p rounds=100
pattern 1024 $lib/pattern.osl
ramps 1024 $lib/ramps.osl
LIST
