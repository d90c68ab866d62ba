#include "vcharge_reconstruction/reconstruction_steps.h"

#include <algorithm>
#include <stdexcept>

#include <gtest/gtest.h>

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

}  // namespace
}  // namespace vcharge
