#include "vcharge_reconstruction/loop_closure.h"

#include <algorithm>
#include <cmath>

#include <tbb/parallel_for.h>
#include <Eigen/LU>

#include "vcharge_core/base/error.h"
#include "vcharge_core/motion/cross_matrix.h"
#include "vcharge_features/descriptor_matching.h"
#include "vcharge_features/place_index.h"
#include "vcharge_geometry/pose_graph/pose_graph.h"
#include "vcharge_geometry/pose_graph/robust_pose_graph.h"
#include "vcharge_geometry/robust/motion_estimation.h"
#include "vcharge_geometry/robust/pose_estimation.h"
#include "vcharge_reconstruction/exposed_ray.h"

namespace vcharge {
namespace {

/// Distance between the keyframes that train the vocabulary: closer ones show the same features.
constexpr double kTrainingSpacing_m = 2.5;
/// Largest angle between the rotations of the planar motion and of the pose among landmarks.
constexpr double kMaxDisagreement_rad = 0.035;
/// A loop edge that differs more from the adjusted keyframes is rejected.
constexpr double kMaxFinalError_m = 0.2;
constexpr double kMaxFinalError_rad = 0.03;
// Standard deviations in the pose graph: of the motion between consecutive keyframes, the same of adjusted
// ones, and of a loop edge in addition to its covariance.
constexpr double kStepSigma_m = 0.01;
constexpr double kStepSigma_rad = 0.001;
constexpr double kAdjustedSigma_m = 0.001;
constexpr double kAdjustedSigma_rad = 0.0001;
constexpr double kLoopSigma_m = 0.03;
constexpr double kLoopSigma_rad = 0.003;
// The same between sessions that nothing has joined yet.
constexpr double kUnknown_m = 1000.0;
constexpr double kUnknown_rad = 3.0;

VocabularyTreeOptions vocabularyOptions() {
  VocabularyTreeOptions options;
  options.max_iterations = 5;
  return options;
}

RobustOptions robustOptions() {
  RobustOptions options;
  options.max_error_rad = 0.005;
  options.max_iterations = 1000;
  options.min_inliers = 12;
  return options;
}

std::vector<cv::Mat> descriptorsOf(const Keyframe& keyframe) {
  std::vector<cv::Mat> descriptors;
  for (const KeyframeImage& image : keyframe.images) {
    descriptors.push_back(image.features.descriptors);
  }
  return descriptors;
}

Ray rayOf(const ReconstructionData& data, int32_t keyframe, int camera, int feature) {
  const KeyframeImage& image = data.keyframes[keyframe].images[camera];
  const cv::Point2f position_px = image.features.keypoints[feature].position_px;
  return rayInVehicle(data.rig->cameras[camera], image.rays_in_camera.col(feature),
                      {position_px.x, position_px.y}, data.keyframes[keyframe].motion.of(camera));
}

/// Matches between two keyframes.
struct LoopMatches {
  std::vector<RayMatch> rays;
  /// The landmark that each keyframe observes along its ray, as a track; -1: none.
  std::vector<int32_t> first_tracks, second_tracks;
};

LoopMatches matchKeyframes(const ReconstructionData& data, int32_t first, int32_t second,
                           const std::vector<std::pair<int, int>>& camera_pairs) {
  LoopMatches result;
  for (const auto& [first_camera, second_camera] : camera_pairs) {
    const KeyframeImage& first_image = data.keyframes[first].images[first_camera];
    const KeyframeImage& second_image = data.keyframes[second].images[second_camera];
    if (first_image.features.empty() || second_image.features.empty()) {
      continue;
    }
    for (const FeatureMatch& match : matchDescriptors(first_image.features.descriptors,
                                                      second_image.features.descriptors, MatchOptions())) {
      RayMatch rays;
      rays.previous = rayOf(data, first, first_camera, match.first_index);
      rays.current = rayOf(data, second, second_camera, match.second_index);
      rays.previous_camera = first_camera;
      rays.current_camera = second_camera;
      rays.quality = -match.distance;
      const auto landmarkOf = [&](int32_t track) {
        return track >= 0 && data.tracks[track].position_m ? track : -1;
      };
      result.rays.push_back(rays);
      result.first_tracks.push_back(landmarkOf(first_image.track_of_feature[match.first_index]));
      result.second_tracks.push_back(landmarkOf(second_image.track_of_feature[match.second_index]));
    }
  }
  return result;
}

/// Pose of one keyframe's rig relative to the landmarks of the reference, in the reference's vehicle frame.
PoseEstimate poseAmongLandmarks(const ReconstructionData& data, int32_t reference, const LoopMatches& matches,
                                const std::vector<int>& inliers, bool reference_is_second) {
  const RigidTransform reference_from_map = data.keyframes[reference].map_from_vehicle.inverse();
  const std::vector<int32_t>& tracks = reference_is_second ? matches.second_tracks : matches.first_tracks;
  std::vector<PointMatch> points;
  for (const int i : inliers) {
    if (tracks[i] >= 0) {
      PointMatch point;
      point.ray = reference_is_second ? matches.rays[i].previous : matches.rays[i].current;
      point.point_m = reference_from_map * *data.tracks[tracks[i]].position_m;
      point.camera = reference_is_second ? matches.rays[i].previous_camera : matches.rays[i].current_camera;
      point.quality = matches.rays[i].quality;
      points.push_back(point);
    }
  }
  return estimateAbsolutePose(points, robustOptions());
}

/// Converts the covariance of target_from_source, over [dt, dphi] in the target's frame, to that of its
/// inverse.
Eigen::Matrix<double, 6, 6> covarianceOfInverse(const RigidTransform& target_from_source,
                                                const Eigen::Matrix<double, 6, 6>& covariance) {
  // source_from_target's translation is -R^T t: it moves by -R^T (dt - dphi x t), its rotation by -R^T dphi.
  const Eigen::Matrix3d turn = target_from_source.rotationMatrix().transpose();
  const Eigen::Matrix3d cross = crossMatrix(target_from_source.translation());
  Eigen::Matrix<double, 6, 6> jacobian = Eigen::Matrix<double, 6, 6>::Zero();
  jacobian.topLeftCorner<3, 3>() = -turn;
  jacobian.topRightCorner<3, 3>() = -turn * cross;
  jacobian.bottomRightCorner<3, 3>() = -turn;
  return jacobian * covariance * jacobian.transpose();
}

/// Rotation that removes roll and pitch of a pose.
Eigen::Quaterniond uprightFromVehicle(const RigidTransform& map_from_vehicle) {
  const double yaw_rad = yawOfRotation(map_from_vehicle.rotation());
  return rotationFromYawPitchRoll(-yaw_rad, 0.0, 0.0) * map_from_vehicle.rotation();
}

Eigen::Matrix<double, 6, 6> diagonalInformation(double sigma_m, double sigma_rad) {
  Eigen::Matrix<double, 6, 1> sigmas;
  // The vector part of a quaternion is half an angle.
  sigmas << sigma_m, sigma_m, sigma_m, 0.5 * sigma_rad, 0.5 * sigma_rad, 0.5 * sigma_rad;
  return sigmas.cwiseAbs2().cwiseInverse().asDiagonal();
}

/// Information of a loop edge for the error of g2o, whose translation is in the second keyframe's frame.
Eigen::Matrix<double, 6, 6> loopInformation(const LoopEdge& edge) {
  Eigen::Matrix<double, 6, 6> first_from_error = Eigen::Matrix<double, 6, 6>::Zero();
  const Eigen::Matrix3d turn = edge.first_from_second.rotationMatrix().transpose();
  first_from_error.topLeftCorner<3, 3>() = turn;
  first_from_error.bottomRightCorner<3, 3>() = 0.5 * turn;
  Eigen::Matrix<double, 6, 6> covariance = edge.covariance;
  covariance.diagonal().head<3>().array() += kLoopSigma_m * kLoopSigma_m;
  covariance.diagonal().tail<3>().array() += kLoopSigma_rad * kLoopSigma_rad;
  covariance = first_from_error * covariance * first_from_error.transpose();
  const Eigen::Matrix<double, 6, 6> information = covariance.inverse();
  return 0.5 * (information + information.transpose());
}

}  // namespace

std::shared_ptr<const VocabularyTree> trainVocabulary(const ReconstructionData& data) {
  std::vector<cv::Mat> descriptors;
  double last_m = -INFINITY;
  bool has_features = false;
  for (const Keyframe& keyframe : data.keyframes) {
    if (keyframe.travelled_m - last_m < kTrainingSpacing_m) {
      continue;
    }
    last_m = keyframe.travelled_m;
    for (const cv::Mat& of_image : descriptorsOf(keyframe)) {
      has_features |= !of_image.empty();
      descriptors.push_back(of_image);
    }
  }
  if (!has_features) {
    throw InputError("no image features in the whole drive: places cannot be recognized");
  }
  return std::make_shared<const VocabularyTree>(VocabularyTree::train(descriptors, vocabularyOptions()));
}

LoopEdge verifyLoop(const LoopClosureOptions& options, const ReconstructionData& data, int32_t first,
                    int32_t second, const std::vector<std::pair<int, int>>& camera_pairs) {
  LoopEdge edge;
  edge.first = first;
  edge.second = second;
  const LoopMatches matches = matchKeyframes(data, first, second, camera_pairs);
  if (static_cast<int>(matches.rays.size()) < options.min_inliers) {
    edge.reason = "too few matches";
    return edge;
  }
  MotionEstimate motion = estimatePlanarMotion(matches.rays, robustOptions());
  const auto needed = std::max<size_t>(
      options.min_inliers,
      static_cast<size_t>(options.min_inlier_ratio * static_cast<double>(matches.rays.size())));
  if (!isUsable(motion) || motion.inliers.size() < needed) {
    motion = estimateKnownVerticalMotion(
        matches.rays, uprightFromVehicle(data.keyframes[first].map_from_vehicle),
        uprightFromVehicle(data.keyframes[second].map_from_vehicle), robustOptions());
    edge.is_planar = false;
  }
  if (!isUsable(motion) || motion.inliers.size() < needed) {
    edge.reason = "no motion explains enough matches";
    return edge;
  }
  // The metric pose in six degrees of freedom, from the rays of one rig and the landmarks of the other.
  const PoseEstimate first_from_second = poseAmongLandmarks(data, first, matches, motion.inliers, false);
  const PoseEstimate second_from_first = poseAmongLandmarks(data, second, matches, motion.inliers, true);
  edge.num_inliers =
      static_cast<int>(std::max(first_from_second.inliers.size(), second_from_first.inliers.size()));
  if (edge.num_inliers == 0) {
    edge.reason = "too few landmarks agree";
    return edge;
  }
  if (first_from_second.inliers.size() >= second_from_first.inliers.size()) {
    edge.first_from_second = first_from_second.map_from_rig;
    edge.covariance = first_from_second.covariance;
  } else {
    edge.first_from_second = second_from_first.map_from_rig.inverse();
    edge.covariance = covarianceOfInverse(second_from_first.map_from_rig, second_from_first.covariance);
  }
  if (angleOfRotation(motion.previous_from_current.rotation().conjugate() *
                      edge.first_from_second.rotation()) > kMaxDisagreement_rad) {
    edge.reason = "matches and landmarks disagree";
  } else if (edge.covariance.topLeftCorner<3, 3>().trace() > options.max_sigma_m * options.max_sigma_m) {
    edge.reason = "too uncertain";
  }
  return edge;
}

namespace {

/// Verifies candidates among the first end_of[i] keyframes for each keyframe i.
std::vector<LoopEdge> findLoopsBefore(const LoopClosureOptions& options,
                                      const std::shared_ptr<const VocabularyTree>& vocabulary,
                                      const ReconstructionData& data, const std::vector<int32_t>& end_of,
                                      const LoopProgress& progress) {
  const auto num_cameras = static_cast<int>(data.rig->cameras.size());
  const auto num_keyframes = static_cast<int32_t>(data.keyframes.size());
  std::vector<std::vector<cv::Mat>> descriptors;
  for (const Keyframe& keyframe : data.keyframes) {
    descriptors.push_back(descriptorsOf(keyframe));
  }
  PlaceIndex index(vocabulary, num_cameras);
  const int32_t num_places = *std::max_element(end_of.begin(), end_of.end());
  index.addAll({descriptors.begin(), descriptors.begin() + num_places});
  constexpr double kIndexed = 0.15;  // part of the time until here
  progress(kIndexed);
  std::vector<std::vector<LoopEdge>> edges_of(num_keyframes);
  constexpr int32_t kBatch = 16;
  for (int32_t begin = 0; begin < num_keyframes; begin += kBatch) {
    tbb::parallel_for(begin, std::min(num_keyframes, begin + kBatch), [&](int32_t i) {
      if (end_of[i] == 0) {
        return;
      }
      for (const PlaceMatch& candidate : index.query(descriptors[i], options.max_candidates, end_of[i])) {
        if (candidate.place + 1 == i) {
          continue;  // the last keyframe of a session and the first of the next are no step of the odometry
        }
        std::vector<std::pair<int, int>> pairs;
        for (int camera = 0; camera < num_cameras; ++camera) {
          if (candidate.cameras[camera] >= 0) {
            pairs.emplace_back(candidate.cameras[camera], camera);
          }
        }
        edges_of[i].push_back(verifyLoop(options, data, candidate.place, i, pairs));
      }
    });
    progress(kIndexed + (1.0 - kIndexed) * begin / num_keyframes);
  }
  std::vector<LoopEdge> edges;
  for (const std::vector<LoopEdge>& of_keyframe : edges_of) {
    edges.insert(edges.end(), of_keyframe.begin(), of_keyframe.end());
  }
  return edges;
}

/// The motion from a keyframe to the next one, and its information for the pose graph.
PoseGraphEdge stepTo(const ReconstructionData& data, size_t i) {
  const Keyframe& previous = data.keyframes[i - 1];
  const Keyframe& keyframe = data.keyframes[i];
  PoseGraphEdge step;
  step.first = static_cast<int64_t>(i) - 1;
  step.second = static_cast<int64_t>(i);
  step.first_from_second = previous.map_from_vehicle.inverse() * keyframe.map_from_vehicle;
  if (keyframe.session == previous.session) {
    step.information = diagonalInformation(kStepSigma_m, kStepSigma_rad);
  } else if (data.sessions[keyframe.session].component == data.sessions[previous.session].component) {
    step.information = diagonalInformation(kLoopSigma_m, kLoopSigma_rad);  // joined at common places
  } else {
    step.information = diagonalInformation(kUnknown_m, kUnknown_rad);
  }
  return step;
}

}  // namespace

std::vector<LoopEdge> findLoops(const LoopClosureOptions& options,
                                const std::shared_ptr<const VocabularyTree>& vocabulary,
                                const ReconstructionData& data, const LoopProgress& progress,
                                int32_t first_of_new) {
  std::vector<int32_t> end_of;
  int32_t end = 0;
  for (const Keyframe& keyframe : data.keyframes) {
    while (keyframe.travelled_m - data.keyframes[end].travelled_m > options.min_travel_m) {
      ++end;
    }
    end_of.push_back(static_cast<int32_t>(end_of.size()) < first_of_new ? 0 : end);
  }
  return findLoopsBefore(options, vocabulary, data, end_of, progress);
}

std::vector<LoopEdge> findLoopsBetween(const LoopClosureOptions& options,
                                       const std::shared_ptr<const VocabularyTree>& vocabulary,
                                       const ReconstructionData& data, int32_t first_of_new,
                                       const LoopProgress& progress) {
  std::vector<int32_t> end_of(data.keyframes.size(), 0);
  std::fill(end_of.begin() + first_of_new, end_of.end(), first_of_new);
  return findLoopsBefore(options, vocabulary, data, end_of, progress);
}

void closeLoops(std::vector<LoopEdge>* edges, ReconstructionData* data, int32_t first_of_new) {
  PoseGraph graph;
  for (size_t i = 0; i < data->keyframes.size(); ++i) {
    graph.map_from_node[static_cast<int64_t>(i)] = data->keyframes[i].map_from_vehicle;
    if (i > 0) {
      graph.edges.push_back(stepTo(*data, i));
      if (static_cast<int32_t>(i) < first_of_new) {
        graph.edges.back().information = diagonalInformation(kAdjustedSigma_m, kAdjustedSigma_rad);
      }
    }
  }
  std::vector<size_t> loops;
  for (size_t i = 0; i < edges->size(); ++i) {
    const LoopEdge& edge = (*edges)[i];
    if (edge.reason.empty()) {
      loops.push_back(i);
      graph.edges.push_back({edge.first, edge.second, edge.first_from_second, loopInformation(edge)});
    }
  }
  if (loops.empty()) {
    return;
  }
  const RobustPoseGraphSummary summary = optimizeRobustly(InformationQuality::kRight, &graph);
  const size_t num_steps = data->keyframes.size() - 1;
  for (size_t i = 0; i < loops.size(); ++i) {
    LoopEdge& edge = (*edges)[loops[i]];
    edge.accepted = summary.accepted[num_steps + i];
    if (!edge.accepted) {
      edge.reason = summary.undecided[num_steps + i] ? kUndecidedLoop : "contradicts the other edges";
    }
  }
  for (size_t i = 0; i < data->keyframes.size(); ++i) {
    data->keyframes[i].map_from_vehicle = graph.map_from_node[static_cast<int64_t>(i)];
  }
}

void checkLoops(const ReconstructionData& data, std::vector<LoopEdge>* edges) {
  for (LoopEdge& edge : *edges) {
    const RigidTransform adjusted =
        data.keyframes[edge.first].map_from_vehicle.inverse() * data.keyframes[edge.second].map_from_vehicle;
    const RigidTransform error = adjusted.inverse() * edge.first_from_second;
    if (edge.accepted && (error.translation().norm() > kMaxFinalError_m ||
                          angleOfRotation(error.rotation()) > kMaxFinalError_rad)) {
      edge.accepted = false;
      edge.reason = "contradicts the adjusted map";
    }
  }
}

}  // namespace vcharge
