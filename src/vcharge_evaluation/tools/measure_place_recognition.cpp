#include <algorithm>
#include <cmath>
#include <cstdio>
#include <iostream>
#include <memory>
#include <optional>
#include <string>
#include <utility>
#include <vector>

#include "features/drive_features.h"
#include "features/epipolar_judge.h"
#include "vcharge_core/base/command_line.h"
#include "vcharge_core/base/error.h"
#include "vcharge_core/base/options.h"
#include "vcharge_core/camera/camera_rig.h"
#include "vcharge_core/motion/trajectory.h"
#include "vcharge_features/descriptor_matching.h"
#include "vcharge_features/place_index.h"

namespace {

using namespace vcharge;

constexpr double kPi = 3.14159265358979323846;
constexpr double kMaxError_rad = 0.3 * kPi / 180.0;
constexpr int kNumSamples = 400;
/// An essential matrix fits eight matches, and some more by chance.
constexpr int kChanceMatches = 12;

struct Arguments {
  std::string bag, query_bag, rig, vocabulary, trajectory, query_trajectory, options;
  double spacing_m = 1.0;
  double max_distance_m = 4.0;
  double min_loop_m = 30.0;
  int num_candidates = 5;
};

struct Frame {
  FeatureFrame features;
  RigidTransform world_from_vehicle;
};

/// The answer for one query: the candidate that most matches verify.
struct Answer {
  int verified = 0;
  bool right = false;
};

struct Query {
  bool same_possible = false, opposite_possible = false;  ///< some place is near, in this direction
  Answer rig, front;
};

std::vector<Frame> withPoses(std::vector<FeatureFrame> features, const Trajectory& trajectory,
                             const std::string& path) {
  std::vector<Frame> frames;
  for (FeatureFrame& frame : features) {
    const auto pose = std::lower_bound(
        trajectory.begin(), trajectory.end(), frame.stamp,
        [](const StampedTransform& stamped, Timestamp stamp) { return stamped.stamp < stamp; });
    if (pose == trajectory.end() || pose->stamp != frame.stamp) {
      throw InputError(path + ": expected a pose at each image, there is none at " + toString(frame.stamp));
    }
    frames.push_back({std::move(frame), pose->world_from_vehicle});
  }
  return frames;
}

class Measurement {
 public:
  Measurement(const CameraRig& rig, std::shared_ptr<const VocabularyTree> vocabulary,
              const Arguments& arguments)
      : rig_(rig),
        arguments_(arguments),
        rig_index_(vocabulary, static_cast<int>(rig.cameras.size())),
        front_index_(std::move(vocabulary), 1) {}

  void addPlace(const Frame& frame) {
    rig_index_.add(descriptorsOf(frame, rig_.cameras.size()));
    front_index_.add(descriptorsOf(frame, 1));
  }

  /// Of the first `end_place` of `places`, which are those that were added.
  Query ask(const Frame& frame, const std::vector<Frame>& places, int end_place) const {
    Query query;
    for (int i = 0; i < end_place; ++i) {
      if (isNear(frame, places[i])) {
        const double angle = angleOfRotation(frame.world_from_vehicle.rotation().conjugate() *
                                             places[i].world_from_vehicle.rotation());
        query.same_possible |= angle < 0.25 * kPi;
        query.opposite_possible |= angle > 0.75 * kPi;
      }
    }
    query.rig = verify(
        frame, places,
        rig_index_.query(descriptorsOf(frame, rig_.cameras.size()), arguments_.num_candidates, end_place));
    query.front = verify(frame, places,
                         front_index_.query(descriptorsOf(frame, 1), arguments_.num_candidates, end_place));
    return query;
  }

 private:
  static std::vector<cv::Mat> descriptorsOf(const Frame& frame, size_t num_cameras) {
    std::vector<cv::Mat> descriptors;
    for (size_t camera = 0; camera < num_cameras; ++camera) {
      descriptors.push_back(frame.features.of_cameras[camera].descriptors);
    }
    return descriptors;
  }

  bool isNear(const Frame& a, const Frame& b) const {
    return (a.world_from_vehicle.translation() - b.world_from_vehicle.translation()).norm() <=
           arguments_.max_distance_m;
  }

  Answer verify(const Frame& frame, const std::vector<Frame>& places,
                const std::vector<PlaceMatch>& candidates) const {
    Answer best;
    for (const PlaceMatch& candidate : candidates) {
      int verified = 0;
      for (size_t camera = 0; camera < candidate.cameras.size(); ++camera) {
        if (candidate.cameras[camera] >= 0) {
          const auto other = static_cast<size_t>(candidate.cameras[camera]);
          verified += std::max(0, countRight(frame, camera, places[candidate.place], other) - kChanceMatches);
        }
      }
      if (verified > best.verified) {
        best = {verified, isNear(frame, places[candidate.place])};
      }
    }
    return best;
  }

  int countRight(const Frame& first, size_t first_camera, const Frame& second, size_t second_camera) const {
    const ImageFeatures& a = first.features.of_cameras[first_camera];
    const ImageFeatures& b = second.features.of_cameras[second_camera];
    const std::vector<FeatureMatch> matches = matchDescriptors(a.descriptors, b.descriptors);
    Eigen::Matrix2Xd first_px(2, static_cast<Eigen::Index>(matches.size())), second_px = first_px;
    for (size_t i = 0; i < matches.size(); ++i) {
      const cv::Point2f p = a.keypoints[matches[i].first_index].position_px;
      const cv::Point2f q = b.keypoints[matches[i].second_index].position_px;
      first_px.col(static_cast<Eigen::Index>(i)) = Eigen::Vector2d(p.x, p.y);
      second_px.col(static_cast<Eigen::Index>(i)) = Eigen::Vector2d(q.x, q.y);
    }
    Eigen::Matrix3Xd first_rays, second_rays;
    std::vector<uint8_t> ignored;  // the mask lets only pixels with a ray through
    rig_.cameras[first_camera].model.unproject(first_px, &first_rays, &ignored);
    rig_.cameras[second_camera].model.unproject(second_px, &second_rays, &ignored);
    return judgeMatches(first_rays, second_rays, kMaxError_rad, 1, kNumSamples).right;
  }

  const CameraRig& rig_;
  const Arguments& arguments_;
  PlaceIndex rig_index_, front_index_;
};

/// Share of the possible queries that are answered rightly by more matches than any wrong answer.
void printRecall(const char* name, const std::vector<Query>& queries, Answer Query::*answer) {
  int threshold = 0;
  for (const Query& query : queries) {
    threshold = std::max(threshold, (query.*answer).right ? 0 : (query.*answer).verified);
  }
  const auto print = [&](bool opposite) {
    int possible = 0, found = 0;
    for (const Query& query : queries) {
      const bool counts = opposite ? query.opposite_possible && !query.same_possible : query.same_possible;
      possible += counts;
      found += counts && (query.*answer).right && (query.*answer).verified > threshold;
    }
    if (possible > 0) {
      std::printf("| %s | %s | %d | %d | %.1f %% |\n", name, opposite ? "opposite" : "same", possible, found,
                  100.0 * found / possible);
    }
  };
  print(false);
  print(true);
}

void measurePlaceRecognition(const Arguments& arguments) {
  FeatureExtractorOptions options;
  if (!arguments.options.empty()) {
    readFieldsFromFile(arguments.options, &options);
  }
  const auto rig = std::make_shared<const CameraRig>(readCameraRig(arguments.rig));
  const auto extractor = makeFeatureExtractor(options);
  const std::vector<Frame> places =
      withPoses(readDriveFeatures(arguments.bag, rig, *extractor, arguments.spacing_m),
                readTrajectory(arguments.trajectory), arguments.trajectory);
  std::vector<cv::Mat> images;
  for (const Frame& frame : places) {
    for (const ImageFeatures& features : frame.features.of_cameras) {
      images.push_back(features.descriptors);
    }
  }
  const auto vocabulary = std::make_shared<const VocabularyTree>(
      arguments.vocabulary.empty() ? VocabularyTree::train(images)
                                   : VocabularyTree::read(arguments.vocabulary));
  Measurement measurement(*rig, vocabulary, arguments);
  for (const Frame& frame : places) {
    measurement.addPlace(frame);
  }
  std::vector<Query> queries;
  if (arguments.query_bag.empty()) {
    int end_place = 0;
    for (const Frame& frame : places) {
      while (places[end_place].features.travelled_m + arguments.min_loop_m < frame.features.travelled_m) {
        ++end_place;
      }
      queries.push_back(measurement.ask(frame, places, end_place));
    }
  } else {
    for (const Frame& frame :
         withPoses(readDriveFeatures(arguments.query_bag, rig, *extractor, arguments.spacing_m),
                   readTrajectory(arguments.query_trajectory), arguments.query_trajectory)) {
      queries.push_back(measurement.ask(frame, places, static_cast<int>(places.size())));
    }
  }
  std::cout << places.size() << " places, " << queries.size() << " queries, " << vocabulary->numWords()
            << " words\n| cameras | direction | possible | found | recall at 100 % precision |\n"
               "|---|---|---|---|---|\n";
  std::fflush(stdout);
  std::cout.flush();
  printRecall("rig", queries, &Query::rig);
  printRecall(rig->cameras[0].name.c_str(), queries, &Query::front);
}

}  // namespace

int main(int argc, char** argv) {
  CLI::App app(
      "Measures place recognition: the places of a drive are asked for by the frames of another drive, or by "
      "its own later frames; candidates are verified by the epipolar geometry of each camera. Prints, for "
      "the rig and for its first camera alone, how many of the frames that are near a place find it with "
      "more verified matches than any wrong answer has.");
  Arguments arguments;
  app.add_option("--bag", arguments.bag, "the drive whose places are learned")->required();
  app.add_option("--trajectory", arguments.trajectory, "its true poses (TUM)")->required();
  app.add_option("--query-bag", arguments.query_bag, "the drive that asks (default: the same, later)");
  app.add_option("--query-trajectory", arguments.query_trajectory, "its true poses (TUM)");
  app.add_option("--rig", arguments.rig, "rig.yaml")->required();
  app.add_option("--vocabulary", arguments.vocabulary, "(default: trained from the places)");
  app.add_option("--options", arguments.options, "YAML with overrides of FeatureExtractorOptions");
  app.add_option("--spacing-m", arguments.spacing_m, "between frames")
      ->capture_default_str()
      ->check(CLI::PositiveNumber);
  app.add_option("--max-distance-m", arguments.max_distance_m, "of a right answer")->capture_default_str();
  app.add_option("--min-loop-m", arguments.min_loop_m, "a drive does not ask for places closer than this")
      ->capture_default_str();
  return runTool(&app, argc, argv, [&] { measurePlaceRecognition(arguments); });
}
