#include "vcharge_mapping/map_summary.h"

#include <string>
#include <utility>
#include <vector>

#include <gtest/gtest.h>

#include "testing/world_drives.h"
#include "vcharge_mapping/session_merger.h"

namespace vcharge {
namespace {

TEST(MapSummaryTest, KeepsThePosesAsCertainAsAsked) {
  const auto map = testing::makeWorld(1);
  SummaryOptions options;
  options.min_found_per_frame = 0.0;
  size_t last = map->landmarks().size();
  for (const double factor : {1.2, 1.5, 2.0, 3.0}) {
    options.max_sigma_factor = factor;
    const SummaryMap summary = summarizeMap(*map, options);
    EXPECT_LE(summary.report.worst_sigma_factor, factor);
    EXPECT_GT(summary.report.worst_sigma_factor, 0.8 * factor);
    EXPECT_LT(summary.report.num_landmarks, last);
    last = summary.report.num_landmarks;
  }
  EXPECT_LT(last, map->landmarks().size() / 5);
}

TEST(MapSummaryTest, KeepsEnoughLandmarksAtEachPlaceOrNoMoreThanAsked) {
  const auto map = testing::makeWorld(1);
  SummaryOptions options;
  options.max_sigma_factor = 10.0;
  options.min_found_per_frame = 3.0;  // as expected: another drive does not find all of them
  const SummaryMap summary = summarizeMap(*map, options);
  for (size_t k = 0; k < summary.map->keyframes().size(); ++k) {
    const size_t num_kept =
        summary.map->observationsOf(k, 1).second - summary.map->observationsOf(k, 0).first;
    const size_t num_before = map->observationsOf(k, 1).second - map->observationsOf(k, 0).first;
    EXPECT_GE(num_kept, std::min<size_t>(37, num_before));
  }
  EXPECT_GE(summary.report.median_num_found, 3.0);
  EXPECT_LT(summary.report.median_num_found, summary.report.median_num_found_before);
  options.max_landmark_ratio = 0.05;
  const SummaryReport least = summarizeMap(*map, options).report;
  EXPECT_LE(least.num_landmarks, map->landmarks().size() / 20 + 1);
  EXPECT_LT(least.median_num_found, summary.report.median_num_found);
}

// The greedy choice is close to the best: the bound of any choice lies less than a tenth below it.
TEST(MapSummaryTest, BoundsWhatAnyChoiceReaches) {
  const auto map = testing::makeWorld(1);
  SummaryOptions options;
  options.max_sigma_factor = 1.0;
  options.min_found_per_frame = 0.0;
  double last = 1e9;
  for (const double ratio : {0.25, 0.5, 0.75, 1.0}) {
    options.max_landmark_ratio = ratio;
    const SummaryReport report = summarizeMap(*map, options).report;
    EXPECT_LE(report.least_sigma_factor, report.mean_sigma_factor);
    EXPECT_GT(report.least_sigma_factor, 0.9 * report.mean_sigma_factor) << ratio;
    EXPECT_LT(report.mean_sigma_factor, last);
    last = report.mean_sigma_factor;
  }
  EXPECT_NEAR(last, 1.0, 1e-9);
}

// At a place of two drives, a frame may find what either of them saw.
TEST(MapSummaryTest, CountsWhatAnotherDriveSawAtThePlace) {
  const auto world = testing::makeWorld(1);
  const auto drive = [&](int number) {
    return testing::driveThrough(
        *world, "day " + std::to_string(number), number, RigidTransform(),
        [number](int keyframe) { return keyframe % 2 == number; },
        [number](int landmark) { return landmark % 4 != 3 * number; });
  };
  const auto both = mergeSession(*drive(0), *drive(1), MergeOptions(), nullptr).map;
  ASSERT_EQ(both->sessions().back().component, 0);
  const auto expected = [](const SparseMap& map) {
    return summarizeMap(map, SummaryOptions()).report.median_num_found_before;
  };
  EXPECT_GT(expected(*both), 1.2 * expected(*drive(0)));
}

// A landmark that is gone says nothing about the pose.
TEST(MapSummaryTest, PrefersLandmarksThatAreStillThere) {
  SparseMapContents contents = testing::makeWorld(1)->contents();
  for (size_t i = 0; i < contents.landmarks.size(); ++i) {
    contents.landmarks[i].presence_log_odds = i % 2 == 0 ? -2.5 : 2.5;
  }
  SummaryOptions options;
  options.max_landmark_ratio = 0.2;
  options.max_sigma_factor = 1.0;
  int num_present = 0;
  const SummaryMap summary = summarizeMap(SparseMap(contents), options);
  for (const MapLandmark& landmark : summary.map->landmarks()) {
    num_present += landmark.presence_log_odds > 0.0 ? 1 : 0;
  }
  EXPECT_GT(num_present, static_cast<int>(summary.report.num_landmarks) * 3 / 4);
  EXPECT_EQ(summarizeMap(SparseMap(contents), options).map->contentHash(), summary.map->contentHash());
}

// Most of what a drive saw over a short way only, another drive does not find: more of it must be kept.
TEST(MapSummaryTest, ExpectsLittleOfLandmarksThatWereSeenOverAShortWay) {
  const auto world = testing::makeWorld(1);
  SparseMapContents contents = world->contents();
  contents.observations.clear();
  contents.descriptors = cv::Mat();
  std::vector<int32_t> first_of(world->landmarks().size(), -1);
  for (size_t i = 0; i < world->observations().size(); ++i) {
    const MapObservation& observation = world->observations()[i];
    int32_t& first = first_of[observation.landmark];
    first = first < 0 ? observation.keyframe : first;
    if (observation.keyframe - first < 2) {
      contents.observations.push_back(observation);
      contents.descriptors.push_back(world->descriptors().row(static_cast<int>(i)));
    }
  }
  SummaryOptions options;
  options.max_sigma_factor = 10.0;
  options.min_found_per_frame = 0.6;
  const auto num_observations = [&](const SparseMap& map) {
    return summarizeMap(map, options).map->observations().size();
  };
  EXPECT_GT(num_observations(SparseMap(contents)), 3 * num_observations(*world) / 2);
}

}  // namespace
}  // namespace vcharge
