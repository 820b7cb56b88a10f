#!/usr/bin/env bash
# The installed library: programs outside of the tree find it, read a fabric and evaluate it. The installed programs find their module for pictures.
# shellcheck source=tests/cli/lib.sh
. "$(dirname "${BASH_SOURCE[0]}")/lib.sh" "$@"
build=$(cd "$bin/.." && pwd)

installed() {
  cmake --install "$build" --prefix "$scratch/prefix" --component library >"$scratch/out"
  if nm -D "$scratch"/prefix/lib*/libselvedge.so 2>/dev/null | grep -qE '__(asan|tsan)_init'; then
    echo "skipped: a program that is built without the sanitizer cannot use a library that has it" >&2
    exit 77
  fi
}

test_a_program_outside_of_the_tree_reads_a_fabric_through_the_installed_library() {
  installed
  selvedge make --quality paper plain-weave --set yarn=tube --yarns on "${small[@]}" -o f.exr --quiet
  cmake -S "$root/examples" -B reader -DCMAKE_PREFIX_PATH="$scratch/prefix" >"$scratch/out"
  cmake --build reader >"$scratch/out"
  reader/evaluate f.exr >read.txt
  [ "$(grep -c '^level .* texels' read.txt)" = 4 ] || fail "not the four levels of 8x8 texels: $(cat read.txt)"
  grep -qE '^yarn of radius [0-9.]+ mm: [0-9]+ nodes over [0-9.]+ mm$' read.txt || fail "no yarn: $(cat read.txt)"
  local level
  for level in 0 1 2 3; do
    exits 0 selvedge evaluate f.exr --level "$level" --texel "$((4 >> level)),$((4 >> level))" --light 1,0,1
    node -e 'const fs = require("fs");
      const [, line, answer] = process.argv;
      const expected = JSON.parse(fs.readFileSync(answer, "utf8"));
      const [r, g, b, alpha] = line.match(/rgb (\S+) (\S+) (\S+), alpha (\S+)/).slice(1).map(Number);
      // Six digits are printed.
      const near = (x, y) => Math.abs(x - y) <= 1e-5 * Math.abs(y);
      const good = near(r, expected.rgb[0]) && near(g, expected.rgb[1]) && near(b, expected.rgb[2]) &&
        near(alpha, expected.alpha);
      if (!good || !(r > 0)) { console.error(line, expected); process.exit(1); }' \
      "$(sed -n "$((level + 1))p" read.txt)" "$scratch/out"
  done
  # A cloth between a white sky and a grey floor, and the error of 20,000 paths.
  reader/path_tracer f.exr >traced.txt
  grep -qE '^radiance 0\.[2-9][0-9]* \+- 0\.00[0-9]+$' traced.txt || fail "no radiance: $(cat traced.txt)"
  head -c 300 f.exr >short.exr
  exits 1 reader/evaluate short.exr
  grep -q '\[[A-Z_]*\]' "$scratch/err" || fail "no code: $(cat "$scratch/err")"
}

test_the_installed_library_shows_nothing_but_its_header() {
  installed
  [ "$(find "$scratch/prefix" -name '*.h' | wc -l)" = 1 ] || fail "more than one header"
  local foreign
  foreign=$(nm -DC --defined-only "$scratch"/prefix/lib*/*/libselvedge.so "$scratch"/prefix/lib*/libselvedge.so \
    2>/dev/null | awk '$2 == "T"' | grep -vE ' selvedge::(FabricFile::|check_fabric_file)' || true)
  [ -z "$foreign" ] || fail "also visible: $foreign"
}

test_the_library_alone_needs_few_packages_and_no_linux() {
  local package blocked=()
  for package in OpenEXR OpenImageIO Threads TBB PNG Ceres CLI11 draco meshoptimizer Eigen3 embree; do
    blocked+=("-DCMAKE_DISABLE_FIND_PACKAGE_$package=ON")
  done
  cmake --no-warn-unused-cli -S "$root" -B alone -G Ninja -DSELVEDGE_LIBRARY_ONLY=ON -DCMAKE_BUILD_TYPE=Debug "${blocked[@]}" >"$scratch/out"
  cmake --build alone >"$scratch/out"
  ctest --test-dir alone >"$scratch/out" || fail "$(cat "$scratch/out")"
  ninja -C alone -t deps >deps.txt
  if grep -E '/(OpenEXR|OpenImageIO|tbb|draco|embree3?|eigen3)/|/meshoptimizer' deps.txt; then fail "needs more"; fi
  grep -q "$root/format/base/input_file.h" deps.txt
  if grep -oE "$root/\S+" deps.txt | sort -u | xargs grep -lE '<(unistd|fcntl|dlfcn|sys/[a-z]+)\.h>'; then fail "is Linux's"; fi
}

test_an_installed_program_loads_openimageio_for_pictures_alone() {
  cmake --install "$build" --prefix "$scratch/prefix" --component programs >"$scratch/out"
  local program=$scratch/prefix/bin/selvedge
  if ldd "$program" | grep OpenImageIO; then fail "is loaded at the start"; fi
  "$program" truth plain-weave --set yarn=tube --size 8x6 --samples 2 -o truth.png --quiet
  [ -s truth.png ] || fail "no picture"
}

"$2"
