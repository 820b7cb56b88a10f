#!/usr/bin/env bash
# `selvedge-view page`, and the gallery that it makes.
# shellcheck source=tests/cli/lib.sh
source "$(dirname "${BASH_SOURCE[0]}")/lib.sh"

test_page_holds_garments_and_fabrics() {
  [ -f "$bin/../share/selvedge/page.html" ] || exit 77
  make_scene
  selvedge dress quad.gltf k.fabric.exr -o beside.gltf --all --quiet
  selvedge-view page beside.gltf quad.glb k.fabric.exr -o page.html --json >page.json
  holds 'r.garments === 2 && r.fabrics === 1' page.json
  [ "$(stat -c %s page.html)" = "$(node -p 'JSON.parse(fs.readFileSync("page.json")).bytes')" ] || fail "other bytes"
  # Each garment is a whole .glb file, also that whose fabric lies beside it.
  node -e 'const text = fs.readFileSync("page.html", "utf8");
    const held = [...text.matchAll(/<script type="text\/plain" data-(garment|fabric)="([^"]+)"[^>]*>([^<]*)</g)];
    const name = "SELVEDGE_materials_fabric";
    if (held.map(([, kind, file]) => `${kind} ${file}`).join() !== "garment beside.gltf,garment quad.glb,fabric k.fabric.exr") throw held;
    for (const [, kind, , base64] of held) {
      const bytes = zlib.inflateSync(Buffer.from(base64, "base64"));
      if (kind === "fabric") {
        if (!bytes.equals(fs.readFileSync("k.fabric.exr"))) throw kind;
        continue;
      }
      const json = JSON.parse(bytes.toString("utf8", 20, 20 + bytes.readUInt32LE(12)));
      const [{ bufferView, uri }] = json.extensions[name].fabrics, view = json.bufferViews[bufferView];
      const begin = 28 + bytes.readUInt32LE(12) + (view.byteOffset ?? 0);
      if (uri || !bytes.subarray(begin, begin + view.byteLength).equals(fs.readFileSync("k.fabric.exr"))) throw kind;
    }'
  # The picture of radiance is held in 64 columns at most, its strength in its values.
  node -e 'process.stdout.write("#?RADIANCE\nFORMAT=32-bit_rle_rgbe\n\n-Y 64 +X 128\n");
    process.stdout.write(Buffer.concat(Array(8192).fill(Buffer.from([128, 128, 128, 129]))))' >white.hdr
  selvedge-view page quad.glb -o around.html --environment white.hdr --environment-strength 2 --environment-turn 30
  node -e 'const [, width, turn, base64] = fs.readFileSync("around.html", "utf8")
      .match(/<script type="text\/plain" data-environment="(\d+)" data-turn="([^"]+)">([^<]*)</);
    const bytes = zlib.inflateSync(Buffer.from(base64, "base64"));
    if (width !== "64" || Number(turn) !== 30 || bytes.length !== 12 * 64 * 32) throw width;
    for (let i = 0; i < bytes.length; i += 4) if (Math.abs(bytes.readFloatLE(i) - 2) > 1e-5) throw i;'
  # The studio is the default.
  selvedge-view page quad.glb -o around.html --quiet
  grep -q 'data-environment="64"' around.html
  grep -q 'data-fps="30"' around.html
  selvedge-view page quad.glb -o around.html --environment none --fps 12.5 --quiet
  ! grep -q data-environment around.html
  grep -q 'data-fps="12.5"' around.html
  selvedge-view page quad.glb -o around.html --backdrop --backdrop-blur 0.3 --quiet
  grep -q 'data-backdrop="0.3"' around.html
}

test_the_gallery_is_a_page_that_draws_its_pictures() {
  [ -e "$bin/../share/selvedge/page.html" ] || exit 77
  mkdir gallery
  for stitch in plain-weave basket; do
    selvedge make $stitch --set yarn=tube "${small[@]}" -o gallery/$stitch.fabric.exr --quiet
  done
  B=$bin "$root/docs/gallery/make" --stitches plain-weave,basket gallery
  [ "$(grep -o 'data-fabric="[a-z-]*.fabric.exr"' gallery/index.html | wc -l)" = 2 ] || fail "other fabrics"
  [ "$(oiiotool --info gallery/overview.png | grep -o '600 x  240')" ] || fail "$(oiiotool --info gallery/overview.png)"
  ! cmp -s gallery/plain-weave.png gallery/basket.png || fail "the fabrics look alike"
}

"$2"
