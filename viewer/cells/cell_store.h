// Cell images of a garment: made for the patches that a frame shows, and kept from frame to frame.
#pragma once

#include <algorithm>
#include <cstdint>
#include <memory>
#include <optional>
#include <span>
#include <vector>

#include "format/cells/cell_image.h"
#include "viewer/cells/patches.h"
#include "viewer/frame/options.h"
#include "viewer/light/shadows.h"
#include "viewer/scene/fabric_sides.h"

namespace selvedge {

/// Radiance of white Lambertian cloth that faces along `normal`.
V3f mean_radiance(const SmoothLight& light, const V3f& normal);

/// Lights of a frame. Bit i of masks is light i; lights after the 32nd count as never in a garment's shadow.
struct CellLights {
  std::span<const Light> lights;
  std::span<const ShadowMap> shadows;
  const SmoothLight* smooth_light = nullptr;   ///< world axes; null: none
  std::span<const SmoothLight> vertex_lights;  ///< of the mesh; empty: `smooth_light` everywhere
  V3d origin{0, 0, 0};                         ///< of the mesh's coordinates

  /// Brightness of white cloth: what cell images are scaled by from place to place. `point`: relative to the
  /// origin. `transmitted_fraction`: part of the light of one side that the other side gets.
  /// `environment_gain`: factor on lamps of an environment. Positive.
  float brightness(const V3f& normal, const V3f& point, const SmoothLight* around_there,
                   float transmitted_fraction, float environment_gain = 1) const;
};

/// A patch seen from one side: twice the patch's number, + 1 for the back.
using PatchSide = std::uint32_t;

/// A patch in sight, and the lights on it.
struct PatchNeed {
  PatchSide patch = 0;
  std::uint32_t lit = 0;             ///< lights of which some of it has a fraction
  std::uint32_t unlit = 0;           ///< lights of which some of it lacks a fraction
  RepeatParts parts = whole_repeat;  ///< that pixels look up
};

/// A frame of a garment. `lights` are copied, the others must live until its end.
struct CellFrame {
  const Camera& camera;
  V2i size;  ///< pixels
  const DrawOptions& options;
  int supersample = 1;  ///< pixels of the frame along either side of a pixel of the picture
  CellLights lights;
  /// Images of patches that are parts of a repeat show these alone, and while it moves, patches without time
  /// for an image show their parents'.
  bool is_economical = false;
};

/// A call of CellStore::make().
struct CellRequest {
  std::span<const PatchNeed> needs;
  bool seen_through_holes = false;  ///< only holes of other surfaces show the patches
  int coarsening = 0;               ///< levels by which parents are needed in place of patches
  double budget_bytes = 0;          ///< of images; 0: CellImageOptions::memory_bytes
  double frame_need_bytes = 0;      ///< CellStore::bytes_of() the frame's needs, if these are some of them
};

/// If no image was made: the levels to try next, with patches that are late (CellStore::is_late()).
struct CellAnswer {
  bool is_made = true;
  int coarsening = 0;
};

/// Memory of the images of a frame.
struct CellMemory {
  double peak_bytes = 0;    ///< that were there at once
  double wanted_bytes = 0;  ///< of the images that should have been there at once, as fine as wanted
  bool is_coarser = false;  ///< some were not as fine
};

/// An image as pixels look it up.
struct CellLook {
  Group size{};                  ///< CellImage::repeat and first
  float inverse_brightness = 1;  ///< CellLights::brightness() that the image was made for, inverse
  float scale = 1;               ///< of radiance
  /// Bounds of the factor by which a pixel is brighter than its image.
  float min_gain = 0.5F, max_gain = 2;
  /// Slope of the rays that the image was made for, and texels along x and y for a step of height and a slope
  /// of 1.
  Group parallax{};
  Group window_size{};  ///< width and height in texels, which of parts of a repeat are fewer
  const CellTexel* texels = nullptr;
  const std::int8_t* heights = nullptr;  ///< CellImage::heights; null: none
  float height_step = 0;                 ///< CellImage::step, mm
  const Variation* variation = nullptr;  ///< null: none
  VariationFade fade = no_fade;
  std::uint32_t plane_lights = 0;  ///< lights that have a plane of their own, in their order behind plane 0
  bool fills_holes = false;        ///< its holes show the yarn around them
  std::uint64_t image = 0;         ///< number of the image, in the order that the store's were made in
  float offset_weight = 1;         ///< of the place that variation gives a pixel, by its fade
};

class CellStore {
 public:
  /// All must outlive the object. `shared`: a store of the same fabrics, whose
  /// prepared yarn is used.
  CellStore(const MergedSurfaces& mesh, std::span<const SurfaceMaterial> materials,
            std::span<const FabricSides> fabrics, const V3d& origin, const CellStore* shared = nullptr);
  ~CellStore();

  const Patches& patches() const { return patches_; }
  /// Takes another shape of the mesh. Images stay as long as they are not outdated.
  void update_shape(const V3d& origin = {0, 0, 0}) {
    origin_ = origin;
    patches_.update_shape(mesh_);
  }
  /// Takes another fabric of the same repeat in place of the only one, and forgets all images.
  void exchange_fabric(const FabricSides& fabric, const CellStore* shared);
  /// CellLights::brightness(): of yarn, and of cloth that lets light through.
  float transmitted_fraction(int fabric) const { return (*cloths_)[fabric].transmitted_fraction; }
  bool has_large_cells() const {
    return std::ranges::any_of(*cloths_, [](const Cloth& cloth) {
      return cloth.front->yarn && cloth.front->yarn->has_large_cell();
    });
  }
  /// Begins a frame: chooses patches.
  void begin(const CellFrame& frame);
  /// Bytes of the images that patches need.
  double bytes_of(std::span<const PatchNeed> needs) const;
  /// Makes images that are missing, and of others those that changed most, for these patches, and keeps
  /// others while all fit into the request's memory; without room for these they are coarser. Makes none
  /// where even the coarsest do not fit, unless the coarsening is max_coarsening, and where patches are late.
  CellAnswer make(const CellRequest& request);
  static constexpr int max_coarsening = 8;
  /// Ends a frame.
  CellMemory end() {
    last_demand_ = demand_;
    return memory_;
  }
  const CellLook& look(PatchSide patch) const { return looks_[look_numbers_[patch]]; }
  bool is_late(PatchSide patch) const { return late_[patch] != 0; }
  /// Whether a call of this frame has made or kept the patch's own image.
  bool is_made(PatchSide patch) const;
  /// Whether a patch is part of a repeat whose rows leave their places: pixels look neighbours up, too.
  bool needs_neighbours(PatchSide patch) const;
  /// Where a patch is looked up in place of `place`: variation moves it.
  RepeatPlace lookup_place(PatchSide patch, const RepeatPlace& place) const;
  /// Lets a patch look like another one until the next call of make().
  void share_look(PatchSide patch, PatchSide other);

 private:
  struct Purpose;
  struct Kept;
  struct Wanted;
  struct Work;
  Wanted wanted(const PatchNeed& need, float samples, bool behind) const;
  Wanted pixel_of(PatchSide patch) const;
  void set_size(Wanted& wanted, float samples, float larger) const;
  float outdated(const Kept& kept, const Wanted& wanted, float samples) const;
  std::shared_ptr<Kept> related_image(PatchSide patch, const Wanted& wanted, float samples) const;
  std::optional<float> budget(std::span<Work> all, float samples, const CellRequest& request);
  void age(std::span<Work> all, float samples, bool tight) const;
  std::vector<Work*> order(std::span<Work> all);
  void render(std::span<const Work> all, std::span<Work* const> order, float samples);
  CellLook look_of(const Work& work) const;
  CellLook& own_look(PatchSide patch);
  void trim(double coming);
  bool postpone(std::span<const Work> all);

  const MergedSurfaces& mesh_;
  std::span<const SurfaceMaterial> materials_;
  /// One side of a fabric.
  struct ClothSide {
    explicit ClothSide(const Fabric& seen);
    const Fabric& fabric;
    CellTexels texels;
    std::vector<float> sky;  ///< sky_transfer() the yarn
    std::optional<CellYarn> yarn;
    std::optional<CellShadows> shadows;
    CellSource source() { return {yarn ? &*yarn : nullptr, shadows ? &*shadows : nullptr, &texels}; }
  };
  struct Cloth {
    std::unique_ptr<ClothSide> front, back;  ///< no back: as the front
    PatchFabric patches;
    float transmitted_fraction = 0;
    bool has_yarn = false;
    ClothSide& seen_from(bool behind) const { return behind && back ? *back : *front; }
  };
  static std::shared_ptr<std::vector<Cloth>> cloths_of(std::span<const FabricSides> fabrics);
  V3d origin_;
  std::shared_ptr<std::vector<Cloth>> cloths_;
  Patches patches_;
  std::size_t bytes_ = 0;                    ///< of the images
  CellMemory memory_;                        ///< of the frame
  double allowance_ = 0;                     ///< cost of images made again that was not spent yet
  double demand_ = 0, last_demand_ = 0;      ///< of this frame and the last: bytes of images as wanted
  double room_ = 0;                          ///< for the images of a call, bytes
  std::vector<std::shared_ptr<Kept>> kept_;  ///< by patch and side; a patch may show a related one's
  std::vector<std::uint32_t> look_numbers_;  ///< by patch and side
  std::vector<CellLook> looks_{1};           ///< the first: none
  std::vector<PatchSide> aliases_;           ///< since the last call of make()
  std::vector<PatchSide> alive_;
  const Camera* camera_ = nullptr;
  CellImageOptions options_;
  LevelOptions levels_;
  const DrawOptions* interrupts_ = nullptr;  ///< DrawOptions::is_interrupted()
  CellLights lights_;
  float large_cell_sample_factor_ = 1;  ///< factor on samples of large cells along a pixel's side
  bool is_economical_ = false;          ///< CellFrame::is_economical
  std::vector<std::uint8_t> late_;      ///< by patch and side
  std::uint64_t call_ = 0;              ///< of make()
  std::uint64_t frame_ = 0;             ///< first call of the frame
  std::uint64_t made_ = 0;              ///< images
};

}  // namespace selvedge
