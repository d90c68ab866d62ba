#include "initialization/camera_landmarks.h"

#include <algorithm>
#include <memory>

#include "rig/ground.h"
#include "vcharge_reconstruction/live_view.h"

namespace vcharge {

LandmarksByCamera recentLandmarksByCamera(const ReconstructionState& state, const CameraRig& initial_rig,
                                          const TriangulationOptions& options, int num_keyframes) {
  const auto end = static_cast<int32_t>(state.data.keyframes.size());
  ReconstructionData part = lastPart(state.data, std::max(0, end - num_keyframes));
  auto rig = std::make_shared<CameraRig>(initial_rig);
  std::vector<bool> has_extrinsics;
  for (RigCamera& camera : rig->cameras) {
    has_extrinsics.push_back(camera.vehicle_from_camera.has_value());
    camera.vehicle_from_camera = camera.vehicle_from_camera.value_or(RigidTransform());
  }
  part.rig = rig;
  triangulateTracks(options, &part);
  LandmarksByCamera landmarks = landmarksByCamera(part);
  for (size_t i = 0; i < landmarks.size(); ++i) {
    if (!has_extrinsics[i]) {
      landmarks[i].clear();
    }
    const double height_m = findCameraHeight(part, static_cast<int32_t>(i)).value_or(0.0);
    for (Eigen::Vector3d& position_m : landmarks[i]) {
      position_m.z() += height_m;
    }
  }
  return landmarks;
}

}  // namespace vcharge
