#include "apps/selvedge/plan_options.h"

#include "apps/selvedge/option_groups.h"

namespace selvedge {
namespace {

void add_camera(CLI::App& app, PlanOptions& plan) {
  const char* group = "Camera, as of selvedge-view render";
  CameraOptions& camera = plan.camera;
  app.add_option("--camera", plan.cameras, "A camera of the file, by name or number; may be repeated")
      ->type_name("NAME|N")
      ->expected(1)
      ->multi_option_policy(CLI::MultiOptionPolicy::TakeAll)
      ->group(group);
  app.add_option_function<std::vector<double>>(
         "--distance",
         [&plan](const std::vector<double>& metres) {
           if (metres.size() == 1) plan.camera.distance = metres[0];
           if (metres.size() == 2) plan.distances = V2d(metres[0], metres[1]);
         },
         "Two: seen from anywhere around, so far at least and at most from the scene's middle; one: of a "
         "single "
         "camera")
      ->type_name("NEAR FAR")
      ->expected(1, 2)
      ->group(group);
  const auto add = [&](const char* name, double& value, const char* type, const char* help) {
    app.add_option(name, value, help)->type_name(type)->capture_default_str()->group(group);
  };
  add("--azimuth", camera.azimuth, "DEGREES", "0 faces the scene's front (+z), 90 its +x side");
  add("--elevation", camera.elevation, "DEGREES", "Above the horizon");
  add("--fov", camera.field_of_view, "DEGREES", "Vertical field of view");
  app.add_flag_callback(
         "--orthographic", [&camera] { camera.projection = Projection::parallel; },
         "Parallel instead of perspective projection")
      ->group(group);
  add("--distance-factor", camera.distance_factor, "FACTOR", "Times the distance that just shows everything");
  add_text(app, "--look-at", "X,Y,Z", "Point in metres that is shown in the middle",
           [&camera](const std::string& t) {
             const auto n = numbers("--look-at", t, ',', 3, 3, "0,1.2,0");
             camera.look_at = V3d(n[0], n[1], n[2]);
           })
      ->group(group);
  add("--zoom", camera.zoom, "FACTOR", "Narrow the frame by this factor");
  add_text(app, "--focus", "X,Y", "Around this point of the frame; 0,0 is its top left, 1,1 its bottom right",
           [&camera](const std::string& t) {
             const auto n = numbers("--focus", t, ',', 2, 2, "0.5,0.5");
             camera.focus = V2d(n[0], n[1]);
           })
      ->group(group);
}

}  // namespace

void add_plan(CLI::App& app, PlanOptions& plan) {
  add_text(app, "--size", "WxH", "Size of the frame in pixels (800x600)", [&plan](const std::string& t) {
    const auto n = whole_numbers("--size", t, 'x', 2, 2, "1920x1080");
    plan.size = V2i(n[0], n[1]);
  });
  app.add_option("--supersample", plan.supersample, "Drawn N times larger per side")
      ->type_name("N")
      ->capture_default_str();
  add_camera(app, plan);
  app.add_option("--scene", plan.choice.scene, "A scene of the file (default: the one it names)")
      ->type_name("NAME|N");
  app.add_option("--variant", plan.choice.variant, "A variant of its materials (default: none)")
      ->type_name("NAME|N");
}

void check_plan_usage(const CLI::App& plan) {
  const bool all_around = plan.count("--distance") == 2;
  const bool of_file = plan.count("--camera") > 0;
  for (const char* option : {"--azimuth", "--elevation", "--distance-factor", "--look-at"}) {
    if (plan.count(option) == 0) continue;
    if (all_around)
      throw CLI::ValidationError(option,
                                 "has no meaning with --distance NEAR FAR, which looks from everywhere");
    if (of_file) throw CLI::ValidationError(option, "has no meaning with --camera");
  }
  for (const char* option : {"--fov", "--orthographic"}) {
    if (of_file && !all_around && plan.count(option) > 0)
      throw CLI::ValidationError(option, "has no meaning with --camera");
  }
  if (plan.count("--orthographic") > 0 && plan.count("--distance") == 0 && plan.count("--fov") > 0)
    throw CLI::ValidationError("--fov", "has no meaning with --orthographic, without --distance");
  if (plan.count("--distance") > 0 && plan.count("--distance-factor") > 0)
    throw CLI::ValidationError("--distance-factor", "has no meaning with --distance");
  if (of_file && plan.count("--distance") == 1)
    throw CLI::ValidationError("--distance", "of a single camera has no meaning with --camera");
}

}  // namespace selvedge
