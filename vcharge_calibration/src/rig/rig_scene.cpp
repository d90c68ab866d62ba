#include "vcharge_calibration/rig/rig_scene.h"

#include <array>

namespace vcharge {

std::string colourOfCamera(size_t camera) {
  static const std::array<const char*, 6> kColours = {"#d62728", "#2ca02c", "#1f77b4",
                                                      "#e8a010", "#9467bd", "#17becf"};
  return kColours[camera % kColours.size()];
}

LandmarksByCamera landmarksByCamera(const ReconstructionData& data) {
  LandmarksByCamera landmarks(data.rig->cameras.size());
  for (const Track& track : data.tracks) {
    if (track.position_m) {
      landmarks[static_cast<size_t>(track.observations.front().camera)].push_back(*track.position_m);
    }
  }
  return landmarks;
}

RigScene makeRigScene(const ReconstructionData& data) {
  RigScene scene{data.rig, {}, landmarksByCamera(data)};
  for (const Keyframe& keyframe : data.keyframes) {
    scene.map_from_vehicle.push_back(keyframe.map_from_vehicle);
  }
  return scene;
}

}  // namespace vcharge
