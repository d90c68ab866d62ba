#include "vcharge_mapping/mapping_checkpoint.h"

#include <sys/resource.h>
#include <csignal>

#include <filesystem>
#include <fstream>
#include <random>
#include <stdexcept>

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include "vcharge_core/base/error.h"
#include "vcharge_core/files/file_io.h"
#include "vcharge_mapping/sparse_mapper.h"
#include "vcharge_reconstruction/testing/test_drive.h"

namespace vcharge {
namespace {

using ::testing::HasSubstr;
namespace fs = std::filesystem;

/// A little more than a round of a circle, as it is after following: tracks end where a point leaves the
/// view, each observation has a feature, and each point its descriptor.
MappingState makeFollowedState() {
  testing::TestDriveOptions drive;
  drive.num_keyframes = 140;
  drive.noise_px = 0.1;
  drive.num_points = 250;
  MappingState state;
  state.data = testing::makeTestDrive(drive);
  std::mt19937 random(7);
  std::vector<Track> passes;
  for (const Track& track : state.data.tracks) {
    cv::Mat descriptor(1, 32, CV_8UC1);
    for (int i = 0; i < 32; ++i) {
      descriptor.at<uint8_t>(i) = static_cast<uint8_t>(random() & 0xFF);
    }
    for (const TrackObservation& seen : track.observations) {
      if (passes.empty() || &seen == track.observations.data() ||
          passes.back().observations.back().keyframe + 1 < seen.keyframe) {
        passes.emplace_back();
      }
      KeyframeImage& image = state.data.keyframes[seen.keyframe].images[seen.camera];
      Keypoint keypoint;
      keypoint.position_px = {static_cast<float>(seen.position_px.x()),
                              static_cast<float>(seen.position_px.y())};
      TrackObservation observation = seen;
      observation.feature = static_cast<int32_t>(image.features.size());
      image.features.keypoints.push_back(keypoint);
      image.features.descriptors.push_back(descriptor);
      image.track_of_feature.push_back(static_cast<int32_t>(passes.size()) - 1);
      passes.back().observations.push_back(observation);
    }
  }
  state.data.tracks = passes;
  for (Keyframe& keyframe : state.data.keyframes) {
    for (size_t camera = 0; camera < keyframe.images.size(); ++camera) {
      KeyframeImage& image = keyframe.images[camera];
      image.rays_in_camera.resize(3, static_cast<Eigen::Index>(image.features.size()));
      for (size_t i = 0; i < image.features.size(); ++i) {
        const cv::Point2f pixel = image.features.keypoints[i].position_px;
        Eigen::Vector3d ray;
        check(state.data.rig->cameras[camera].model.unproject(Eigen::Vector2d(pixel.x, pixel.y), &ray),
              "a point that was seen has a ray");
        image.rays_in_camera.col(static_cast<Eigen::Index>(i)) = ray;
      }
    }
    state.frames.push_back({keyframe.stamp, static_cast<int32_t>(state.frames.size()), RigidTransform(),
                            MotionHypothesis::kPlanar});
    if (state.frames.size() > 1) {
      state.keyframe_from_next.push_back((&keyframe - 1)->map_from_vehicle.inverse() *
                                         keyframe.map_from_vehicle);
    }
  }
  state.report.num_frames = 140;
  state.report.num_missing_images = {3, 0};
  state.report.skipped = {{"standing", Timestamp::fromNanoseconds(5), Timestamp::fromNanoseconds(9), 2}};
  state.report.stage_s = {{"following", 1.5}};
  return state;
}

class MappingCheckpointTest : public ::testing::Test {
 protected:
  MappingCheckpointTest() : folder_(fs::path(::testing::TempDir()) / "mapping_checkpoint_test") {
    fs::remove_all(folder_);
    fs::create_directories(folder_);
    path_ = (folder_ / "lot.vmap.work").string();
  }
  ~MappingCheckpointTest() override { fs::remove_all(folder_); }

  std::string key() const { return checkpointKey("drive", *rig_, SparseMapperOptions(), "program"); }

  const std::shared_ptr<const CameraRig> rig_ = testing::makeTestRig();
  fs::path folder_;
  std::string path_;
};

TEST_F(MappingCheckpointTest, GoingOnFromEveryStageGivesTheSameMap) {
  SparseMapper whole(rig_, SparseMapperOptions());
  whole.resume(makeFollowedState());
  std::vector<std::string> stages;
  const auto map = whole.finish(StageCallback(), [&](const std::string& stage, const MappingState& state) {
    writeCheckpoint(state, key(), path_ + std::to_string(stages.size()));
    stages.push_back(stage);
  });
  ASSERT_EQ(stages.size(), backEndStages().size() + 1);
  EXPECT_EQ(stages.front(), "following");
  EXPECT_FALSE(map->contents().loop_edges.empty());
  for (size_t i = 0; i < stages.size(); ++i) {
    CheckpointReading reading = readCheckpoint(path_ + std::to_string(i), key(), rig_);
    ASSERT_TRUE(reading.state) << stages[i] << ": " << reading.refusal;
    EXPECT_EQ(reading.state->num_finished_stages, static_cast<int>(i));
    SparseMapper rest(rig_, SparseMapperOptions());
    rest.resume(std::move(*reading.state));
    std::vector<std::string> run;
    const auto same = rest.finish([&](const StageProgress& progress) {
      if (run.empty() || run.back() != progress.stage) {
        run.push_back(progress.stage);
      }
    });
    EXPECT_EQ(same->contentHash(), map->contentHash()) << stages[i];
    EXPECT_EQ(run.size(), stages.size() - i) << stages[i];
    EXPECT_EQ(rest.report().num_missing_images, whole.report().num_missing_images);
    EXPECT_EQ(rest.report().num_observations, whole.report().num_observations);
    ASSERT_EQ(rest.trajectory().size(), whole.trajectory().size());
    EXPECT_EQ(rest.trajectory().back().world_from_vehicle.matrix(),
              whole.trajectory().back().world_from_vehicle.matrix());
  }
}

TEST_F(MappingCheckpointTest, KeepsTheReport) {
  writeCheckpoint(makeFollowedState(), key(), path_);
  const CheckpointReading reading = readCheckpoint(path_, key(), rig_);
  ASSERT_TRUE(reading.state);
  const SparseMapperReport& report = reading.state->report;
  EXPECT_EQ(report.num_frames, 140);
  ASSERT_EQ(report.skipped.size(), 1U);
  EXPECT_EQ(report.skipped[0].reason, "standing");
  EXPECT_EQ(report.skipped[0].last.nanoseconds(), 9);
  EXPECT_EQ(report.stage_s.at("following"), 1.5);
  EXPECT_EQ(reading.state->frames[1].motion, MotionHypothesis::kPlanar);
  EXPECT_EQ(reading.state->vocabulary, nullptr);
}

TEST_F(MappingCheckpointTest, RefusesWhatItCannotTrust) {
  EXPECT_FALSE(readCheckpoint(path_, key(), rig_).state);
  EXPECT_EQ(readCheckpoint(path_, key(), rig_).refusal, "");  // no file is no fault
  writeCheckpoint(makeFollowedState(), key(), path_);
  const std::string whole = readTextFile(path_);
  const auto refusalOf = [&](const std::string& bytes) {
    writeTextFileAtomically(path_, bytes);
    const CheckpointReading reading = readCheckpoint(path_, key(), rig_);
    EXPECT_FALSE(reading.state);
    EXPECT_THAT(reading.refusal, HasSubstr(path_));
    return reading.refusal;
  };
  EXPECT_THAT(refusalOf(""), HasSubstr("no checkpoint"));
  EXPECT_THAT(refusalOf("SQLite format 3 and more"), HasSubstr("no checkpoint"));
  EXPECT_THAT(refusalOf(whole.substr(0, 20)), HasSubstr("truncated"));
  EXPECT_THAT(refusalOf(whole.substr(0, whole.size() / 2)), HasSubstr("truncated"));
  EXPECT_THAT(refusalOf(whole + "x"), HasSubstr("damaged"));
  std::string damaged = whole;
  damaged[whole.size() / 3] ^= 1;
  EXPECT_THAT(refusalOf(damaged), HasSubstr("damaged"));
  std::string newer = whole;
  newer[8] = 9;
  EXPECT_THAT(refusalOf(newer), HasSubstr("format 9"));
}

TEST_F(MappingCheckpointTest, AnotherDriveRigOptionOrProgramIsAnotherKey) {
  writeCheckpoint(makeFollowedState(), key(), path_);
  SparseMapperOptions options;
  options.keyframe_distance_m = 0.7;
  CameraRig moved = *rig_, masked = *rig_;
  moved.cameras[0].vehicle_from_camera = RigidTransform();
  masked.cameras[0].mask = cv::Mat(400, 640, CV_8UC1, cv::Scalar(255));
  CameraRig masked_elsewhere = masked;
  masked_elsewhere.cameras[0].mask = cv::Mat(400, 640, CV_8UC1, cv::Scalar(0));
  EXPECT_NE(checkpointKey("drive", masked, SparseMapperOptions(), "program"),
            checkpointKey("drive", masked_elsewhere, SparseMapperOptions(), "program"));
  for (const std::string& other : {checkpointKey("other", *rig_, SparseMapperOptions(), "program"),
                                   checkpointKey("drive", moved, SparseMapperOptions(), "program"),
                                   checkpointKey("drive", masked, SparseMapperOptions(), "program"),
                                   checkpointKey("drive", *rig_, options, "program"),
                                   checkpointKey("drive", *rig_, SparseMapperOptions(), "newer program")}) {
    const CheckpointReading reading = readCheckpoint(path_, other, rig_);
    EXPECT_FALSE(reading.state);
    EXPECT_THAT(reading.refusal, HasSubstr("another drive or rig"));
  }
  EXPECT_TRUE(readCheckpoint(path_, key(), rig_).state);
}

TEST_F(MappingCheckpointTest, AFullDiskIsAnErrorThatLeavesTheOldCheckpoint) {
  writeCheckpoint(makeFollowedState(), key(), path_);
  const std::string before = readTextFile(path_);
  rlimit old{};
  getrlimit(RLIMIT_FSIZE, &old);
  const auto old_handler = std::signal(SIGXFSZ, SIG_IGN);
  rlimit small = old;
  small.rlim_cur = before.size() / 2;
  setrlimit(RLIMIT_FSIZE, &small);
  std::string message;
  try {
    writeCheckpoint(makeFollowedState(), key(), path_);
  } catch (const InputError& error) {
    message = error.what();
  }
  setrlimit(RLIMIT_FSIZE, &old);
  std::signal(SIGXFSZ, old_handler);
  EXPECT_THAT(message, HasSubstr(path_ + ": cannot be written: File too large"));
  EXPECT_EQ(readTextFile(path_), before);
  EXPECT_EQ(std::distance(fs::directory_iterator(folder_), fs::directory_iterator()), 1);
  EXPECT_THROW(writeCheckpoint(makeFollowedState(), key(), "/no/such/folder/lot.vmap.work"), InputError);
}

TEST(MapBackEndTest, WhatACallbackThrowsEndsTheWork) {
  SparseMapper mapper(testing::makeTestRig(), SparseMapperOptions());
  mapper.resume(makeFollowedState());
  EXPECT_THROW(mapper.finish([](const StageProgress& progress) {
    if (progress.stage == "loops") {
      throw std::runtime_error("enough");
    }
  }),
               std::runtime_error);
}

}  // namespace
}  // namespace vcharge
