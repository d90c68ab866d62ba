#include "vcharge_mapping/map_report.h"

#include <algorithm>
#include <cmath>

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include "vcharge_reconstruction/testing/test_drive.h"

namespace vcharge {
namespace {

using ::testing::ElementsAre;
using ::testing::HasSubstr;
using ::testing::IsEmpty;
using ::testing::Not;

/// A map of the test drive without remarks.
class MapReportTest : public ::testing::Test {
 protected:
  MapReportTest() {
    state_.data = testing::makeTestDrive(testing::TestDriveOptions());
    contents_.rig = *state_.data.rig;
    for (size_t k = 0; k < state_.data.keyframes.size(); ++k) {
      const Keyframe& keyframe = state_.data.keyframes[k];
      contents_.keyframes.push_back({keyframe.stamp, keyframe.map_from_vehicle});
      state_.frames.push_back(
          {keyframe.stamp, static_cast<int32_t>(k), RigidTransform(), MotionHypothesis::kAckermann});
    }
    for (const Track& track : state_.data.tracks) {
      for (const TrackObservation& seen : track.observations) {
        contents_.observations.push_back({seen.keyframe, seen.camera,
                                          static_cast<int32_t>(contents_.landmarks.size()),
                                          seen.position_px.cast<float>()});
      }
      contents_.landmarks.push_back({*track.position_m, Eigen::Matrix3d::Zero()});
    }
    contents_.descriptors = cv::Mat::zeros(static_cast<int>(contents_.observations.size()), 32, CV_8UC1);
    contents_.loop_edges.push_back({0, 39, RigidTransform(), 30, true, ""});
    state_.report.counters.frames = 40;
    state_.report.num_motions = {0, 39, 0, 0};
    state_.report.counters.missing_images = {0, 0};
    state_.report.rms_px = 0.3;
    state_.report.stages = {"following", "loops"};
    state_.report.stage_s = {{"following", 12.34}, {"loops", 5.0}};
  }

  MapVerdict judge() const { return judgeMap(SparseMap(contents_), state_); }
  std::string page() const { return makeMapReport("Map <lot>", SparseMap(contents_), state_); }
  /// Expects this grade, and one remark that contains this text.
  void expect(MapGrade grade, const std::string& remark) const {
    const MapVerdict verdict = judge();
    EXPECT_EQ(verdict.grade, grade) << remark;
    EXPECT_THAT(verdict.remarks, ElementsAre(HasSubstr(remark)));
  }

  SparseMapContents contents_;
  ReconstructionState state_;
};

TEST_F(MapReportTest, AGoodMapHasNoRemarks) {
  EXPECT_EQ(judge().grade, MapGrade::kGood);
  EXPECT_THAT(judge().remarks, IsEmpty());
}

TEST_F(MapReportTest, RemarksOnEachDefect) {
  contents_.loop_edges.clear();
  expect(MapGrade::kCheck, "no loop");
  contents_.loop_edges.assign(4, {0, 39, RigidTransform(), 30, true, ""});
  contents_.loop_edges.push_back({1, 38, RigidTransform(), 30, false, "contradicts the other edges"});
  expect(MapGrade::kCheck, "contradict");
  contents_.loop_edges.pop_back();
  state_.report.rms_px = 1.5;
  expect(MapGrade::kCheck, "1.50 px");
  state_.report.rms_px = 4.0;
  expect(MapGrade::kBad, "4.00 px");
  state_.report.rms_px = 0.3;
  state_.report.num_motions = {10, 20, 0, 9};
  expect(MapGrade::kCheck, "odometer alone");
  state_.report.num_motions = {30, 9, 0, 0};
  expect(MapGrade::kBad, "odometer alone");
  state_.report.num_motions = {0, 30, 9, 0};
  expect(MapGrade::kCheck, "unlike rolling wheels");
  state_.report.num_motions = {0, 20, 0, 19};  // a ramp is not a fault
  EXPECT_EQ(judge().grade, MapGrade::kGood);
  state_.data.odometry_distance_scale = 0.95;
  expect(MapGrade::kCheck, "true distances are 0.9500");
  state_.data.odometry_distance_scale = 1.0;
  state_.data.odometry_turn_scale = 1.2;
  expect(MapGrade::kBad, "true turns are 1.2000");
  state_.data.odometry_turn_scale = 1.0;
  state_.report.counters.frames_without_odometry = 4;
  expect(MapGrade::kCheck, "10.0 % of the frames have no odometry");
  state_.report.counters.frames_without_odometry = 0;
  state_.report.counters.incomplete_frames = 40;
  expect(MapGrade::kCheck, "lack a camera");
  state_.report.counters.incomplete_frames = 0;
  state_.report.counters.odometry_resets = 1;
  expect(MapGrade::kCheck, "odometer was reset");
}

TEST_F(MapReportTest, RemarksOnKeyframesWithFewLandmarks) {
  const SparseMapContents whole = contents_;
  for (const auto& [num_left, grade] : {std::make_pair(59, MapGrade::kCheck), {19, MapGrade::kBad}}) {
    // Limits the observations of the last 10 of 40 keyframes.
    contents_ = whole;
    contents_.observations.clear();
    std::vector<int> count(40, 0);
    std::vector<int32_t> new_index(whole.landmarks.size(), -1);
    contents_.landmarks.clear();
    for (MapObservation observation : whole.observations) {
      if (observation.keyframe >= 30 && count[observation.keyframe]++ >= num_left) {
        continue;
      }
      int32_t& index = new_index[observation.landmark];
      if (index < 0) {
        index = static_cast<int32_t>(contents_.landmarks.size());
        contents_.landmarks.push_back(whole.landmarks[observation.landmark]);
      }
      observation.landmark = index;
      contents_.observations.push_back(observation);
    }
    contents_.descriptors = cv::Mat::zeros(static_cast<int>(contents_.observations.size()), 32, CV_8UC1);
    expect(grade, "25.0 % of the keyframes see fewer than " + std::to_string(num_left + 1));
  }
}

TEST_F(MapReportTest, ThePageIsCompleteAndSelfContained) {
  contents_.loop_edges.push_back({3, 30, RigidTransform(), 10, false, "too uncertain"});
  state_.report.skipped = {
      {"without camera left", contents_.keyframes[3].stamp, contents_.keyframes[6].stamp, 4}};
  state_.report.counters.incomplete_frames = 4;
  state_.report.counters.missing_images = {0, 4};
  const std::string text = page();
  for (const char* part :
       {"Map &lt;lot&gt;", "class=\"verdict CHECK\"", "From above", "1 accepted", "1 rejected: too uncertain",
        "ackermann</td><td>39", "How the vehicle moved", "height (m)", "landmarks in view",
        "error of reprojection (px)", "following</td><td>12.34", "sum</td><td>17.34", "without camera left",
        "<td>0.60</td><td>1.20</td><td>4</td>"}) {
    EXPECT_THAT(text, HasSubstr(part));
  }
  const auto body = text.begin() + static_cast<std::ptrdiff_t>(text.find("<body>"));
  EXPECT_EQ(std::count(body, text.end(), '<'), std::count(body, text.end(), '>'));
  for (const char* outside : {"src=\"http", "href=", "url(", "<script"}) {
    EXPECT_THAT(text, Not(HasSubstr(outside)));
  }
  EXPECT_THAT(text, Not(HasSubstr("nan")));
  EXPECT_THAT(text, Not(HasSubstr("inf")));
}

TEST_F(MapReportTest, MakesAPageOfAStandingVehicle) {
  for (MapKeyframe& keyframe : contents_.keyframes) {
    keyframe.map_from_vehicle = RigidTransform();
  }
  for (Keyframe& keyframe : state_.data.keyframes) {
    keyframe.map_from_vehicle = RigidTransform();
  }
  const std::string text = page();
  EXPECT_THAT(text, Not(HasSubstr("nan")));
  EXPECT_THAT(text, Not(HasSubstr("inf")));
}

}  // namespace
}  // namespace vcharge
