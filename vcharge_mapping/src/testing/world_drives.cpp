#include "testing/world_drives.h"

#include <utility>
#include <vector>

#include "vcharge_reconstruction/testing/test_map.h"

namespace vcharge::testing {

std::shared_ptr<const SparseMap> makeWorld(uint32_t seed) {
  TestMapOptions options;
  options.num_keyframes = kNumKeyframes;
  options.seed = seed;
  return makeTestMap(options);
}

std::shared_ptr<const SparseMap> driveThrough(const SparseMap& world, const std::string& name, int day,
                                              const RigidTransform& drive_from_world,
                                              const std::function<bool(int)>& has_keyframe,
                                              const std::function<bool(int)>& shows_landmark) {
  SparseMapContents contents = world.contents();
  contents.sessions = {{name, "", 0}};
  contents.keyframes.clear();
  contents.landmarks.clear();
  contents.observations.clear();
  contents.next_keyframe_id = contents.next_landmark_id = 0;
  contents.descriptors = cv::Mat(0, world.descriptors().cols, world.descriptors().type());
  std::vector<int32_t> keyframe_of(world.keyframes().size(), -1);
  std::vector<int32_t> landmark_of(world.landmarks().size(), -1);
  for (size_t i = 0; i < world.keyframes().size(); ++i) {
    if (has_keyframe(static_cast<int>(i))) {
      MapKeyframe keyframe = world.keyframes()[i];
      keyframe.stamp = Timestamp::fromNanoseconds(keyframe.stamp.nanoseconds() + day * 86'400'000'000'000LL);
      keyframe.map_from_vehicle = drive_from_world * keyframe.map_from_vehicle;
      keyframe.id = kNoId;
      keyframe_of[i] = static_cast<int32_t>(contents.keyframes.size());
      contents.keyframes.push_back(keyframe);
    }
  }
  for (size_t i = 0; i < world.observations().size(); ++i) {
    MapObservation observation = world.observations()[i];
    if (keyframe_of[observation.keyframe] < 0 || !shows_landmark(observation.landmark)) {
      continue;
    }
    int32_t& landmark = landmark_of[observation.landmark];
    if (landmark < 0) {
      landmark = static_cast<int32_t>(contents.landmarks.size());
      contents.landmarks.push_back(world.landmarks()[observation.landmark]);
      contents.landmarks.back().position_m = drive_from_world * contents.landmarks.back().position_m;
      contents.landmarks.back().id = kNoId;
    }
    observation.keyframe = keyframe_of[observation.keyframe];
    observation.landmark = landmark;
    contents.observations.push_back(observation);
    contents.descriptors.push_back(world.descriptors().row(static_cast<int>(i)));
  }
  return std::make_shared<const SparseMap>(std::move(contents));
}

}  // namespace vcharge::testing
