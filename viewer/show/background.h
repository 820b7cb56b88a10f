// The picture of `show`, made on a thread of its own: small at first, then in full, then with more samples,
// so that the window answers at once however long a frame takes.
#pragma once

#include <atomic>
#include <condition_variable>
#include <deque>
#include <functional>
#include <map>
#include <mutex>
#include <set>
#include <thread>

#include "format/gltf/limits.h"
#include "viewer/show/picture.h"

namespace selvedge {

/// A fabric that is not read until it is worn.
struct OfferedFabric {
  std::string path;
  std::vector<std::uint8_t> picture;  ///< thumbnail_side x thumbnail_side, in display.h's form
};

inline constexpr int thumbnail_side = 96;

/// The picture that a window asks for.
struct RenderRequest {
  ShowState state;
  Redraw redraw = Redraw::none;          ///< since the last request
  V2i size{1, 1};                        ///< of the picture, pixels
  std::optional<V2d> probed_point = {};  ///< a point of it, as in ShowPicture::probe_surface()
  int generation = 0;  ///< RenderUpdate::generation of the state; a request of an older one is dropped
};

/// A picture, and what the panel says of it and of the scene.
struct ShownPicture : DrawnPicture {
  double size_divisor = 1;                ///< it is smaller than the request by so much per side
  std::int64_t frame_count = 0;           ///< drawn so far, samples of pictures at rest not counted
  std::vector<std::string> materials;     ///< names; empty names for those without fabric
  std::vector<std::string> fabric_names;  ///< to choose from
  int levels = 1;                 ///< the most that a fabric has, coarser than any that the file leaves out
  std::vector<Light> own_lights;  ///< of the scene's file
};

/// Another garment, which the window shows from now on.
struct ShownGarment {
  std::string path;
  std::optional<CameraOptions> camera;  ///< nullopt: the window keeps its camera
  FabricChoice worn_fabrics;
  int clip = -1;  ///< ShowState::clip
};

/// Changes since the last poll().
struct RenderUpdate {
  std::shared_ptr<const ShownPicture> picture;  ///< null: no other than before
  /// The last point that was probed (RenderRequest::probed_point), and the surface there.
  std::optional<V2d> probed_point;
  std::optional<PixelProbe> probe;
  std::uint64_t probe_request = 0;  ///< the number of its request
  /// A new garment (the one in `picture`), or the last valid state if the request failed. Requests of the
  /// generation before are dropped.
  std::optional<ShownGarment> garment;
  std::optional<ShowState> state;
  std::optional<FabricChoice>
      worn_fabrics;  ///< was put on, after all of these; the generation is another, too
  int generation = 0;
  std::vector<std::shared_ptr<const Surroundings>> environments;  ///< that were added
  std::vector<OfferedFabric> offers;                              ///< that were added
  std::vector<std::string> messages;  ///< errors and remarks, a line each; an empty one: a file was added
  std::optional<Error> failure;       ///< nothing can be drawn any more
  /// The last request has its picture in full size, and its probe.
  bool is_finished = false;
};

/// Functions that write files of garments; called from the thread of the picture. They throw Failure.
struct GarmentWriter {
  /// Dresses a garment in a fabric, and returns the file of the result, which nothing else uses.
  std::function<std::string(const std::string& garment, const std::string& fabric)> dress;
  /// Writes a garment as it is worn. Returns remarks.
  std::function<std::string(const std::string& garment, const Scene& worn, const std::string& output)> save;
};

class PictureThread {
 public:
  /// `garment`: the file of the picture's scene, `name` the one that the user has named. Calls `wake` from
  /// its thread whenever there is an update. `limits` hold for garments that are added.
  PictureThread(std::unique_ptr<ShowPicture> picture, std::string garment, std::string name,
                const SceneLimits& limits, GarmentWriter writer, std::function<void()> wake);
  /// Ends what is being drawn.
  ~PictureThread();

  /// Replaces the request before; a change ends what is being drawn for that, except its small first picture.
  /// Returns the request's number.
  std::uint64_t request(RenderRequest request);
  /// Adds a fabric, a folder of fabrics or an environment to choose from, or shows another garment.
  void add_file(const std::string& path) { queue(path, &PictureThread::add, When::at_once); }
  /// Puts a fabric on everything that wears one, or dresses a garment on which nothing does.
  void wear(const std::string& path) { queue(path, &PictureThread::put_on, When::at_once); }
  /// Writes the picture once it has all samples, to the first free name of STEM-1.png, STEM-2.png ...
  void save_picture(const std::string& stem) { queue(stem, &PictureThread::write_picture, When::at_rest); }
  /// Writes the garment as it is worn then, to STEM-1.glb and so on.
  void save_garment(const std::string& stem) { queue(stem, &PictureThread::write_garment, When::at_rest); }
  RenderUpdate poll();

 private:
  enum class When { at_once, between_samples, at_rest };
  using Action = std::string (PictureThread::*)(const std::string& path);
  struct Task {
    When when;
    std::string path;
    Action action;
  };

  void queue(const std::string& path, Action action, When when);
  std::vector<Task> take_tasks();
  void perform(const Task& task);

  /// The next step for the request.
  enum class Stage { first, full, samples, rest };

  void run();
  void draw_first();
  void draw_in_full();
  void add_samples();
  void probe();
  // Actions: each returns a message about the file, or throws a Failure.
  std::string add(const std::string& path);
  void add_fabric(const std::string& path);
  std::string offer(const std::string& path);
  std::string put_on(const std::string& path);
  std::string write_picture(const std::string& stem);
  std::string write_garment(const std::string& stem);
  std::string show_garment(const std::string& path, const std::string& name, bool keeps_camera);
  void show(const std::optional<ShownGarment>& garment = {});
  void post(const std::function<void(RenderUpdate&)>& change);

  // Shared by the window and the thread, under the mutex.
  std::mutex mutex_;
  std::condition_variable there_is_work_;
  std::optional<RenderRequest> next_;
  std::uint64_t requests_ = 0;
  std::deque<Task> tasks_;
  RenderUpdate update_;
  std::atomic<bool> closes_{false};
  std::atomic<bool> interrupted_{false};  ///< what is drawn in full is not wanted any more
  std::atomic<bool> asked_{false};        ///< there is a request

  // The thread's alone.
  std::unique_ptr<ShowPicture> picture_;
  std::string garment_;
  std::string name_;
  std::map<std::string, int> added_;  ///< fabrics, by file
  std::set<std::string> offered_;
  SceneLimits limits_;
  GarmentWriter garment_writer_;
  std::function<void()> wake_;
  RenderRequest request_;
  std::uint64_t number_ = 0;      ///< of the request
  Redraw change_ = Redraw::none;  ///< since the last picture
  double divisor_ = 1;            ///< of the last picture
  FramePace pace_;                ///< of first pictures
  int generation_ = 0;
  Stage stage_ = Stage::rest;
  bool probes_ = false;            ///< the probe of the request is still to be made
  std::optional<ShowState> good_;  ///< the last state that could be drawn
  std::int64_t frames_ = 0;
  std::thread thread_;
};

}  // namespace selvedge
