#include "vcharge_simulation/sensors/recorded_cameras.h"

#include <type_traits>

#include "vcharge_core/base/error.h"
#include "vcharge_simulation/sensors/golf_rig.h"
#include "vcharge_simulation/sensors/rig_catalogue.h"

namespace vcharge {

namespace {

// Rejects camera names in faults that would silently have no effect.
void checkCamerasOfFaults(const FaultOptions& faults, const CameraRig& rig) {
  forEachOption(faults, [&](const OptionDeclaration& option, const auto& fault) {
    using Fault = std::decay_t<decltype(fault)>;
    if constexpr (std::is_base_of_v<CameraFault, Fault>) {
      const bool all_allowed = !std::is_same_v<Fault, SwappedCamerasFault>;
      for (const std::string& camera : fault.cameras) {
        if (rig.findCamera(camera) < 0 && !(all_allowed && camera == "all")) {
          throw InputError("faults." + std::string(option.name) + ".cameras: expected recorded cameras" +
                           (all_allowed ? " or all" : "") + ", got '" + camera + "'");
        }
      }
    }
  });
}

std::shared_ptr<const VehicleBody> makeBody(const DriveScenario& scenario, const CameraRig& rig) {
  switch (scenario.body) {
    case BodyKind::kNone:
      return nullptr;
    case BodyKind::kGlossy:
      return makeGlossyBody(rig, static_cast<uint64_t>(scenario.rig_seed));
    default:
      return makeGolfBody();
  }
}

RigCamera bumped(RigCamera camera, const BumpedCameraFault& fault) {
  if (fault.actsOn(camera.name)) {
    const RigidTransform before_from_after(rotationFromVector(Eigen::Vector3d(fault.rotation_rad.data())),
                                           Eigen::Vector3d(fault.translation_m.data()));
    camera.vehicle_from_camera = *camera.vehicle_from_camera * before_from_after;
  }
  return camera;
}

}  // namespace

RecordedCameras::RecordedCameras(const DriveScenario& scenario, const std::string& mask_folder)
    : faults_(scenario.faults) {
  scenario.validate();
  const CameraRig whole =
      makeRig(scenario.rig, static_cast<uint64_t>(scenario.rig_seed), scenario.image_scale);
  if (scenario.cameras.empty()) {
    rig_ = whole;
    for (size_t i = 0; i < whole.cameras.size(); ++i) {
      indices_.push_back(static_cast<int>(i));
    }
  }
  for (const std::string& name : scenario.cameras) {
    const size_t index = whole.cameraIndex(name);
    rig_.cameras.push_back(whole.cameras[index]);
    indices_.push_back(static_cast<int>(index));
  }
  checkCamerasOfFaults(faults_, rig_);
  const auto body = makeBody(scenario, whole);
  for (RigCamera& camera : rig_.cameras) {
    views_.emplace_back(camera, body, scenario.lens);
    bumped_views_.push_back(faults_.bumped_camera.actsOn(camera.name)
                                ? CameraView(bumped(camera, faults_.bumped_camera), body, scenario.lens)
                                : views_.back());
    camera.mask = views_.back().mask();
    camera.mask_file = mask_folder + "/" + camera.name + "_mask.png";
  }
}

const CameraView& RecordedCameras::view(size_t camera, Duration since_start) const {
  const bool is_bumped = faults_.bumped_camera.actsOn(name(camera), since_start);
  return (is_bumped ? bumped_views_ : views_).at(camera);
}

Readout RecordedCameras::readout(size_t camera, Duration since_start, const MotionWindow& motion) const {
  const RollingShutterFault& rolling = faults_.rolling_shutter;
  Readout readout(motion, rolling.actsOn(name(camera), since_start) ? rolling.readout_time_s : 0.0);
  readout.middle_s = faults_.image_stamp_shift.exposureShiftOf(name(camera), since_start);
  return readout;
}

size_t RecordedCameras::partner(size_t camera) const {
  const std::vector<std::string>& pair = faults_.swapped_cameras.cameras;
  return rig_.cameraIndex(name(camera) == pair[0] ? pair[1] : pair[0]);
}

size_t RecordedCameras::plug(size_t camera, Duration since_start) const {
  return faults_.swapped_cameras.actsOn(name(camera), since_start) ? partner(camera) : camera;
}

CameraRig RecordedCameras::rigAfterFaults() const {
  CameraRig rig = rig_;
  for (size_t i = 0; i < size(); ++i) {
    const size_t seen = faults_.swapped_cameras.actsOn(name(i)) ? partner(i) : i;
    const RigCamera& source = bumped_views_[seen].camera();
    RigCamera& camera = rig.cameras[i];
    camera.image_size_px = source.image_size_px;
    camera.model = source.model;
    camera.field_of_view_rad = source.field_of_view_rad;
    camera.vehicle_from_camera = source.vehicle_from_camera;
    camera.mask = bumped_views_[seen].mask();
  }
  return rig;
}

}  // namespace vcharge
