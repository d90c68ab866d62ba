#include "vcharge_reconstruction/reconstruction_steps.h"

#include <algorithm>
#include <stdexcept>

#include <gtest/gtest.h>

#include "vcharge_reconstruction/bundle_adjustment.h"
#include "vcharge_reconstruction/testing/test_drive.h"

namespace vcharge {
namespace {

constexpr int32_t kFirstOfNew = 30;

/// The beginning of a followed drive, as it was then.
ReconstructionState beginningOf(const ReconstructionState& followed) {
  ReconstructionState beginning = followed;
  beginning.data.keyframes.resize(kFirstOfNew);
  for (Track& track : beginning.data.tracks) {
    const auto is_new = [](const TrackObservation& o) { return o.keyframe >= kFirstOfNew; };
    track.observations.erase(std::remove_if(track.observations.begin(), track.observations.end(), is_new),
                             track.observations.end());
  }
  return beginning;
}

class ExtendReconstructionTest : public ::testing::Test {
 protected:
  ExtendReconstructionTest() {
    followed_.data = testing::makeTestDrive(testing::TestDriveOptions());
    adjusted_ = beginningOf(followed_);
  }
  ReconstructionState followed_, adjusted_;
};

TEST_F(ExtendReconstructionTest, GivesTheFollowedDriveWhereNothingWasAdjusted) {
  extendReconstruction(followed_, &adjusted_);
  ASSERT_EQ(adjusted_.data.keyframes.size(), followed_.data.keyframes.size());
  ASSERT_EQ(adjusted_.data.tracks.size(), followed_.data.tracks.size());
  for (size_t i = 0; i < followed_.data.keyframes.size(); ++i) {
    const RigidTransform error =
        adjusted_.data.keyframes[i].map_from_vehicle.inverse() * followed_.data.keyframes[i].map_from_vehicle;
    EXPECT_LT(error.translation().norm(), 1e-9) << "the odometer counts what is true";
  }
  for (size_t t = 0; t < followed_.data.tracks.size(); ++t) {
    const auto& found = adjusted_.data.tracks[t].observations;
    const auto& expected = followed_.data.tracks[t].observations;
    ASSERT_EQ(found.size(), expected.size());
    for (size_t i = 0; i < found.size(); ++i) {
      EXPECT_EQ(found[i].keyframe, expected[i].keyframe);
      EXPECT_EQ(found[i].camera, expected[i].camera);
    }
  }
}

TEST_F(ExtendReconstructionTest, NewKeyframesContinueTheAdjustedPath) {
  const RigidTransform correction = RigidTransform::planar(0.2, -0.1, 0.03);
  for (Keyframe& keyframe : adjusted_.data.keyframes) {
    keyframe.map_from_vehicle = correction * keyframe.map_from_vehicle;
  }
  extendReconstruction(followed_, &adjusted_);
  const RigidTransform expected = correction * followed_.data.keyframes.back().map_from_vehicle;
  EXPECT_LT((adjusted_.data.keyframes.back().map_from_vehicle.translation() - expected.translation()).norm(),
            1e-9);
}

TEST_F(ExtendReconstructionTest, ObservationsGoToTheTrackThatTheirsWasJoinedTo) {
  const auto isSeenOnBothSides = [](const Track& track) {
    return !track.observations.empty() && track.observations.front().keyframe < kFirstOfNew &&
           track.observations.back().keyframe >= kFirstOfNew;
  };
  std::vector<int32_t> both;
  for (size_t t = 0; t < followed_.data.tracks.size(); ++t) {
    if (isSeenOnBothSides(followed_.data.tracks[t])) {
      both.push_back(static_cast<int32_t>(t));
    }
  }
  ASSERT_GE(both.size(), 3U);
  // The third track was joined to the second, and that one to the first.
  std::vector<Track>& tracks = adjusted_.data.tracks;
  for (size_t i = 2; i > 0; --i) {
    tracks[both[i]] = Track();
    tracks[both[i]].joined_to = both[i - 1];
  }
  extendReconstruction(followed_, &adjusted_);
  EXPECT_TRUE(tracks[both[1]].observations.empty());
  EXPECT_TRUE(tracks[both[2]].observations.empty());
  const std::vector<TrackObservation>& joined = tracks[both[0]].observations;
  const auto isBefore = [](const TrackObservation& a, const TrackObservation& b) {
    return std::make_pair(a.keyframe, a.camera) < std::make_pair(b.keyframe, b.camera);
  };
  EXPECT_TRUE(std::is_sorted(joined.begin(), joined.end(), isBefore));
  for (const int32_t t : both) {
    const TrackObservation& last = followed_.data.tracks[t].observations.back();
    EXPECT_TRUE(std::binary_search(joined.begin(), joined.end(), last, isBefore));
    if (t == both[2]) {
      break;
    }
  }
}

TEST_F(ExtendReconstructionTest, RefusesAStateOfAnotherDrive) {
  followed_.data.keyframes.resize(10);
  EXPECT_THROW(extendReconstruction(followed_, &adjusted_), std::logic_error);
}

/// A drive past unlike points, whose cameras expose their lines one after the other and at times of their
/// own.
ReconstructionState exposedDrive() {
  testing::TestDriveOptions options;
  options.num_points = 200;
  options.timings = {{0.02, ReadoutDirection::kDown, 0.001}, {0.015, ReadoutDirection::kRight, 0.0}};
  options.image_offsets_s = {0.0, 0.03};
  ReconstructionState state;
  state.data = testing::makeTestDrive(options);
  for (Track& track : state.data.tracks) {
    for (TrackObservation& observation : track.observations) {
      cv::Mat& descriptors =
          state.data.keyframes[observation.keyframe].images[observation.camera].features.descriptors;
      observation.feature = descriptors.rows;
      observation.position_px += Eigen::Vector2d(0.3, -0.2);  // an error
      descriptors.push_back(cv::Mat(1, 32, CV_8UC1, cv::Scalar(observation.feature % 256)));
    }
  }
  return state;
}

double worstDeviation(const ReconstructionData& data, const Eigen::Vector2d& usual_error_px) {
  double worst_px = 0.0;
  for (const Track& track : data.tracks) {
    for (const TrackObservation& observation : track.observations) {
      Eigen::Vector2d error_px;
      EXPECT_TRUE(reprojectionError(data, track, observation, &error_px));
      worst_px = std::max(worst_px, (error_px - usual_error_px).norm());
    }
  }
  return worst_px;
}

TEST(MapOfExposedLines, HoldsWhatCamerasWouldHaveSeenAtTheStamps) {
  const ReconstructionState state = exposedDrive();
  const Eigen::Vector2d error_px(-0.3, 0.2);
  EXPECT_LT(worstDeviation(state.data, error_px), 0.05);  // lines of the observations with the error
  const std::shared_ptr<const SparseMap> map = assembleMap(state, "");
  const ReconstructionData again = reconstructionOf(*map, 1.0);
  ASSERT_GT(again.tracks.size(), 50U);
  EXPECT_LT(worstDeviation(again, error_px), 0.05);
  // As if all had been exposed at the stamp.
  ReconstructionData at_stamp = again;
  auto rig = std::make_shared<CameraRig>(*again.rig);
  for (RigCamera& camera : rig->cameras) {
    camera.timing = ImageTiming();
  }
  at_stamp.rig = rig;
  EXPECT_LT(worstDeviation(at_stamp, error_px), 0.05);
}

}  // namespace
}  // namespace vcharge
