// Shading of the yarn's points in cell images: light that points reflect, from tables of the light that
// reaches the stations of their curves and from shadow grids.
#pragma once

#include <array>
#include <cstdint>
#include <memory>
#include <span>
#include <vector>

#include "format/cells/cell_shadows.h"
#include "format/cells/cell_view.h"
#include "format/simd/fetch.h"

namespace selvedge {

SELVEDGE_INLINE Floats4 group_lanes(const Group& group) { return load_group(&group, 0); }
SELVEDGE_INLINE void accumulate(const Floats4& value, Group& to) {
  const Floats4 sum = group_lanes(to) + value;
  std::memcpy(&to, &sum, sizeof sum);
}

/// Light that a station has for one lamp, or for smooth light.
struct LightSlot {
  int plane = 0;
  enum { front, behind, sky } source = front;
};

/// A lamp before the cell.
struct FrontLamp {
  V3f raised_direction{0, 0, 1};
  V3f irradiance{0, 0, 0};
  float horizon_fade = 1;  ///< no step where the light sets
  int plane = 0;
  V2f slope{0, 0};
  std::shared_ptr<const CellShadow> shadow = nullptr;  ///< nothing is in shadow
};

struct ShadingJob {
  const CellYarn& yarn;
  const YarnPieces& pieces;
  const CellView& view;
  std::span<const FrontLamp> lamps;
  std::span<const LightSlot> slots;
  std::span<const Group> station_table;  ///< fill_station_table()
  float sample_width = 0;                ///< of what a sample stands for, mm
  std::span<const float> lamp_basis{};   ///< light_basis_of_lamps(), in place of the table
};

struct ShadingBatch {
  static constexpr std::size_t capacity = 256;
  std::size_t count = 0;
  alignas(64) std::array<float, capacity> x, y, z;           ///< from the piece's start, mm
  alignas(64) std::array<float, capacity> shift_x, shift_y;  ///< how far the image's map moves the piece, mm
  std::array<std::int32_t, capacity> piece;
  std::array<std::uint32_t, capacity> texel;
};

/// Names the slots of light. The table has one more, with the moments.
std::vector<LightSlot> light_slots(const CellYarn& yarn, const CellView& view);
/// The functions of light of each lamp, [function][colour][lamp], with zeros up to whole vectors.
std::vector<float> light_basis_of_lamps(const CellYarn& yarn, const CellView& view);
/// Fills the table, [station][angle function][slot], of some stations, or of all.
void fill_station_table(const CellYarn& yarn, const CellView& view,
                        const std::vector<std::uint32_t>* stations, std::vector<Group>& table);
/// The lamps before the cell, with their shadows. `pixel`: its width, mm. `heights`: of the lowest and the
/// highest point that is shaded, mm.
std::vector<FrontLamp> make_front_lamps(const CellYarn& yarn, const CellView& view, float pixel,
                                        const V2f& heights, CellShadows& shadows);
/// Shades the points of a batch, and adds them to raw[texel][plane]; opacity is 1.
void shade(const ShadingJob& job, const ShadingBatch& batch, Group* raw);

}  // namespace selvedge
