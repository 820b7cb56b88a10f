// The built-in stitches.
#include "converter/stitch/library.h"

namespace selvedge {
namespace {

using Threads = StitchEntry::Threads;

StitchEntry knit(const char* name, const char* description, double cover, const char* chart) {
  return {name, description, cover, chart};
}

StitchEntry weave(const char* name, const char* description, double cover, std::vector<std::string> rows,
                  const char* fibre, const Threads& warp, const Threads& weft, const Gloss& gloss = {}) {
  return {name, description, cover, "", {std::move(rows), fibre, warp, weft, gloss}};
}

}  // namespace

std::vector<StitchEntry> built_in_entries() {
  return {
      knit("plain-knit", "stockinette from its face, of natural wool", 0.902,
           "yarn A: albedo=0.60,0.53,0.43\n1: k"),
      knit("purl", "stockinette from its back", 0.888, "yarn A: albedo=0.60,0.53,0.43\n1: p"),
      knit("rib", "1x1 rib: alternate wales of knit and purl", 0.940,
           "yarn A: albedo=0.60,0.53,0.43\n1: k p"),
      knit("rib-2x2", "2x2 rib: two wales of knit, two of purl", 0.949,
           "yarn A: albedo=0.60,0.53,0.43\n1: k2 p2"),
      knit("garter", "garter stitch: alternate courses of knit and purl", 0.958,
           "yarn A: albedo=0.60,0.53,0.43\n2: p\n1: k"),
      knit("two-colour", "stockinette with courses of two colours", 0.902,
           "yarn A: albedo=0.62,0.56,0.45\nyarn B: albedo=0.06,0.11,0.26\n2: k [B]\n1: k [A]"),
      knit("lace", "eyelets: yarn overs and decreases in every second course, in alternate columns", 0.759,
           "yarn A: albedo=0.60,0.53,0.43 radius_mm=0.61\n4: k2tog k2 yo\n3: k4\n2: k yo k2tog k\n1: k4"),
      weave("plain-weave", "alternately over and under, off-white warp and blue weft", 0.990, {"-#", "#-"},
            "cotton", {0.7, 0.25, {0.62F, 0.58F, 0.50F}}, {1, 0.24, {0.09F, 0.17F, 0.38F}}),
      weave("twill", "2/2 twill, dark warp and light weft", 0.987, {"#--#", "--##", "-##-", "##--"}, "cotton",
            {1, 0.34, {0.07F, 0.08F, 0.13F}}, {1, 0.35, {0.55F, 0.48F, 0.37F}}),
      weave("herringbone", "2/2 twill that turns every four warps, grey warp and light weft", 0.990,
            {"#--#-##-", "--##--##", "-##-#--#", "##--##--"}, "wool", {0.875, 0.29, {0.12F, 0.11F, 0.10F}},
            {1, 0.37, {0.52F, 0.49F, 0.43F}}),
      weave("denim", "3/1 twill from its warp face, dense indigo warp and off-white weft", 0.989,
            {"###-", "##-#", "#-##", "-###"}, "cotton", {0.75, 0.3, {0.030F, 0.050F, 0.120F}},
            {1.05, 0.28, {0.62F, 0.58F, 0.50F}}),
      weave("satin", "5-end satin from its warp face, dense glossy warp", 1.000,
            {"####-", "##-##", "-####", "###-#", "#-###"}, "silk", {0.5, 0.29, {0.60F, 0.42F, 0.20F}},
            {1, 0.22, {0.45F, 0.29F, 0.12F}}, {0.2F, 0.25F}),
      weave("basket", "2x2 basket weave in two shades of linen", 0.993, {"##--", "##--", "--##", "--##"},
            "linen", {0.8, 0.28, {0.52F, 0.42F, 0.28F}}, {1, 0.345, {0.36F, 0.25F, 0.14F}})};
}

}  // namespace selvedge
