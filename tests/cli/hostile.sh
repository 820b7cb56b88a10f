#!/usr/bin/env bash
# What a picture or a stitch of somebody else can do: end no program, take no more memory than is allowed, print no
# second line. The hostile files are made here.
# shellcheck source=tests/cli/lib.sh
source "$(dirname "${BASH_SOURCE[0]}")/lib.sh"

# write_pictures STATEMENT: with what makes pictures of 32 x 16 pixels of one colour, or of other sizes that they only
# declare, `save(NAME, BYTES)`, and the table of measured pictures of a name, `table(NAME)`.
write_pictures() {
  # shellcheck disable=SC2016
  node -e 'const fs = require("fs");
    const save = (name, bytes) => fs.writeFileSync(name, bytes);
    const table = name => save(`${name}.csv`, "file,light_x,light_y,light_z,view_x,view_y,view_z\n" +
      [...Array(20).keys()].map(i => `${name},0,${i / 20},1,0,0,1\n`).join(""));
    const pnm = (kind, width, height) =>
      Buffer.concat([Buffer.from(`P${kind}\n${width} ${height}\n255\n`), Buffer.alloc(1536, 255)]);
    const hdr = (width, height) => Buffer.concat([
      Buffer.from(`#?RADIANCE\nFORMAT=32-bit_rle_rgbe\n\n-Y ${height} +X ${width}\n`),
      ...Array(512).fill(Buffer.from([128, 128, 128, 129]))]);
    // Tags with their numbers; the pixels follow at 300. Strips of all rows, unless there are tiles.
    const tiff = (width, height, more = {}) => {
      const tags = Object.entries({256: width, 257: height, 258: 8, 259: 1, 262: 1, 277: 1,
        ...(more[322] ? {324: 300, 325: 512} : {273: 300, 278: height, 279: 512}), ...more});
      const data = Buffer.alloc(300 + 512, 255);
      data.write("II*\0\x08\0\0\0", "latin1"), data.writeUInt16LE(tags.length, 8);
      tags.forEach(([tag, value], i) => {
        data.writeUInt16LE(tag, 10 + 12 * i), data.writeUInt16LE(4, 12 + 12 * i);
        data.writeUInt32LE(1, 14 + 12 * i), data.writeUInt32LE(value, 18 + 12 * i);
      });
      return data.fill(0, 10 + 12 * tags.length, 14 + 12 * tags.length);
    };
    const segment = (marker, ...data) => Buffer.from([255, marker, 0, data.length + 2, ...data]);
    // Grey of all blocks: one code for a difference of zero, one for the end of a block.
    const code = kind => segment(0xC4, kind, 1, ...Array(15).fill(0), 0);
    const jpeg = (width, height) => Buffer.concat([Buffer.from([255, 0xD8]), segment(0xDB, 0, ...Array(64).fill(1)),
      segment(0xC0, 8, height >> 8, height & 255, width >> 8, width & 255, 1, 1, 0x11, 0), code(0), code(0x10),
      segment(0xDA, 1, 1, 0, 0, 63, 0), Buffer.from([0, 0, 255, 0xD9])]);
    const attribute = (name, type, data) => {
      const size = Buffer.alloc(4);
      size.writeInt32LE(data.length);
      return Buffer.concat([Buffer.from(`${name}\0${type}\0`), size, data]);
    };
    const int32 = (...numbers) => Buffer.from(Int32Array.from(numbers).buffer);
    // One channel of floats, in rows or in tiles of any size.
    const exr = (width, height, tile = null) => {
      const window = int32(0, 0, width - 1, height - 1);
      const start = Buffer.concat([Buffer.from([0x76, 0x2F, 0x31, 1, 2, tile ? 2 : 0, 0, 0]),
        attribute("channels", "chlist", Buffer.concat([Buffer.from("Y\0"), int32(2, 0, 1, 1), Buffer.alloc(1)])),
        attribute("compression", "compression", Buffer.alloc(1)), attribute("dataWindow", "box2i", window),
        attribute("displayWindow", "box2i", window), attribute("lineOrder", "lineOrder", Buffer.alloc(1)),
        attribute("pixelAspectRatio", "float", Buffer.from(Float32Array.of(1).buffer)),
        attribute("screenWindowCenter", "v2f", Buffer.alloc(8)),
        attribute("screenWindowWidth", "float", Buffer.from(Float32Array.of(1).buffer)),
        ...(tile ? [attribute("tiles", "tiledesc", Buffer.concat([int32(tile, tile), Buffer.alloc(1)]))] : []),
        Buffer.alloc(1)]);
      const rows = [...Array(16).keys()].map(y => start.length + 128 + y * (8 + 128));
      return Buffer.concat([start, Buffer.from(BigInt64Array.from(rows.map(BigInt)).buffer),
        ...rows.map((_, y) => Buffer.concat([int32(y, 128), Buffer.from(new Float32Array(32).fill(1).buffer)]))]);
    };
    '"$png_writer$1"
}

# answers COMMAND...: it ends by itself, within 20 s of the processor and 2 GB, with a result or with one line.
answers() {
  local status=0
  if sanitized; then exit 77; fi
  bash -c 'ulimit -t 20 -v 2000000; exec "$@"' "$0" "$@" >"$scratch/out" 2>"$scratch/err" || status=$?
  [ "$status" -le 1 ] || fail "status $status of: $*: $(cat "$scratch/err")"
  [ "$(wc -l <"$scratch/err")" = "$status" ] || fail "not $status lines from: $*: $(cat "$scratch/err")"
}

test_pictures_are_read_by_their_first_bytes_whatever_their_name() {
  write_pictures 'save("pnm.tif", pnm(6, 32, 16)), save("hdr.png", hdr(32, 16)), save("tiff.jpg", tiff(32, 16));
    save("png.exr", png(head(32, 16, 8), chunk("IDAT", zlib.deflateSync(Buffer.alloc(33 * 16, 255).map(
      (value, i) => i % 33 ? value : 0))), end));
    save("exr", exr(32, 16));'
  # White, as all of them are.
  for file in pnm.tif hdr.png tiff.jpg png.exr; do exits 0 compare-pictures $file exr --max 0; done
}

test_files_of_other_kinds_are_no_pictures() {
  write_quad quad.gltf
  # A picture of 4 x 4 pixels in FITS, which is not among them.
  write_pictures 'const cards = ["SIMPLE  =                    T", "BITPIX  =                    8",
      "NAXIS   =                    2", "NAXIS1  =                    4", "NAXIS2  =                    4", "END"];
    const fits = cards => cards.map(card => card.padEnd(80)).join("").padEnd(2880).padEnd(5760, "x");
    save("fits", fits(cards));
    // So many axes that OpenImageIO does not come to an end.
    save("axes", fits([cards[0], "NAXIS   =          99999999999", "END"]));
    save("simple", "SIMPLE  =".padEnd(2880)), save("gif", "GIF89a" + "\0".repeat(100)), save("empty", "");
    save("text", "the secret of the server"), save("p", "P");'
  for kind in fits axes simple gif empty text p; do
    for name in a.png a.exr a.fits a; do
      cp $kind $name
      refuses IMAGE_UNREADABLE 'PNG, JPEG, WebP, TIFF, OpenEXR, Radiance HDR, PNM' compare-pictures $name $name
    done
    refuses IMAGE_UNREADABLE 'a.png: is no picture' selvedge-view render quad.gltf -o o.png --environment a.png
  done
  write_pictures 'table("fits");'
  refuses IMAGE_UNREADABLE 'fits: is no picture' selvedge import fits.csv --width 10 -o o.samples.exr
}

test_what_a_picture_declares_is_reckoned_before_it_is_taken() {
  if sanitized; then exit 77; fi
  # A black picture of 32 KB that would take 4 GB, and headers alone.
  write_pictures 'const side = 16000;
    save("black.png", png(head(side, side), zeros(side, side), end)), save("wide.png", png(head(2 ** 31 - 1, 1)));
    save("zero.png", png(head(0, 0), end)), save("a.jpeg", jpeg(65500, 65500)), save("a.pnm", pnm(6, side, side));
    save("zero.pnm", pnm(6, 0, 0)), save("a.hdr", hdr(2 ** 31 - 1, 2 ** 31 - 1)), save("b.hdr", hdr(2 * side, side));
    save("scans.jpeg", Buffer.concat([jpeg(8, 8), ...Array(100).fill(segment(0xDA, 1, 1, 0, 0, 63, 0))]));
    save("a.tif", tiff(side, side)), save("tile.tif", tiff(8, 8, {322: 32000, 323: 32000})), save("zero.tif", tiff(0, 0));
    save("deep.tif", tiff(side, side, {258: 64, 277: 4})), save("channels.tif", tiff(3000, 3000, {277: 65535}));
    save("a.exr", exr(side, side)), save("b.exr", exr(2 ** 30, 2 ** 30)), save("tile.exr", exr(side, side, 1));
    save("c.exr", exr(8, 8, 40000));
    save("digits.pnm", "P6 " + "1".repeat(1e7) + " 8 255 "), save("line.hdr", "#?RADIANCE\n" + "x".repeat(1e7));'
  for file in *.*; do
    answers compare-pictures "$file" "$file"
    [ -s "$scratch/err" ] || fail "$file is read"
  done
  refuses FILE_TOO_LARGE '16000 x 16000 pixels of 1 channels take more than 4096 MiB' \
    compare-pictures black.png black.png
}

test_environments_and_measured_pictures_are_reckoned_within_max_memory() {
  make_plane_fabric
  # 56 MB as environments, 96 MB while they are averaged.
  write_pictures 'save("sky.png", png(head(2000, 1000), zeros(2000, 1000), end)), table("sky.png");'
  environment() { selvedge-view "$1" quad.gltf -o "$2" --environment sky.png --max-memory "$3"; }
  refuses FILE_TOO_LARGE 'sky.png: 2000 x 1000 pixels take more' environment render o.png 40M
  exits 0 environment render o.png 100M
  if [ -f "$bin/../share/selvedge/page.html" ]; then refuses FILE_TOO_LARGE sky.png environment page o.html 40M; fi
  measured() { selvedge import sky.png.csv --width 10 --period 5,5 --texels 2 --views 1 --lights 1 -o o.samples.exr --quiet "$@"; }
  refuses FILE_TOO_LARGE 'pictures of 2000 x 1000 pixels' measured --max-memory 80M
  exits 0 measured --max-memory 120M
}

test_refuses_stitches_that_would_take_hours_or_all_memory() {
  kept_short() { (if ! sanitized; then ulimit -v 1000000; fi && timeout 60 "$@"); }
  # All shafts by each of the mentions of a treadle.
  node -e 'const list = (count, of) => Array.from({length: count}, of).join();
    console.log("[WIF]\n[WEAVING]\nShafts=4096\nTreadles=1\n[WARP]\nThreads=2\n[WEFT]\nThreads=200\n[THREADING]\n1=1\n2=2");
    console.log("[TIEUP]\n1=" + list(4096, (_, k) => k + 1) + "\n[TREADLING]");
    for (let weft = 1; weft <= 200; ++weft) console.log(weft + "=" + list(2000, () => 1));' >many.wif
  refuses STITCH_INVALID 'many.wif: every warp yarn stays on one side' kept_short selvedge stitch many.wif
  local yarn='"albedo":[1,1,1],"segments":[[[0,0,0],[1e30,0,0],[1e30,0,0],[2e30,0,0]]]'
  echo "{\"selvedge_stitch\":1,\"name\":\"far\",\"period_mm\":[2e30,2e30],\"yarns\":[{\"radius_mm\":1e29,$yarn}]}" >far.json
  refuses STITCH_INVALID 'far.json: /period_mm/0' kept_short selvedge stitch far.json
}

"$2"
