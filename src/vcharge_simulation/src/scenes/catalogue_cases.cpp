#include "scenes/catalogue_cases.h"

#include <map>

#include "vcharge_simulation/drive/drive_simulator.h"
#include "vcharge_simulation/scenes/scene_catalogue.h"

namespace vcharge {

namespace {

constexpr double kImageScale = 0.3;
constexpr double kImagePeriod_s = 0.08;

}  // namespace

const Renderer& rendererOf(const std::string& scene) {
  static std::map<std::string, Renderer> renderers;
  const auto found = renderers.find(scene);
  if (found != renderers.end()) {
    return found->second;
  }
  SceneOptions options;
  options.image_scale = kImageScale;
  options.detail = 0.25;
  return renderers.emplace(scene, buildScene(scene, options)).first->second;
}

Moment momentOf(const SceneCase& scene_case, int later_frames) {
  static std::map<std::string, SimulatedDrive> drives;
  const DrivePlan plan = planDrive(scene_case.scene, scene_case.drive);
  const std::string name = std::string(scene_case.scene) + plan.name;
  if (drives.count(name) == 0) {
    drives.emplace(name, simulateDrive(plan.path, plan.motion, WheelOdometerOptions(), 1, 1, FaultOptions(),
                                       plan.ground_height));
  }
  const int frame = scene_case.frame + later_frames;
  return {drives.at(name).world_from_vehicle.at(static_cast<size_t>(frame)).world_from_vehicle,
          plan.start_s + kImagePeriod_s * frame};
}

}  // namespace vcharge
