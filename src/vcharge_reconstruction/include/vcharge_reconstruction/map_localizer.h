#pragma once

#include <algorithm>
#include <cstdint>
#include <memory>
#include <vector>

#include <Eigen/Core>

#include "vcharge_core/base/options.h"
#include "vcharge_core/camera/camera_rig.h"
#include "vcharge_core/frames/image.h"
#include "vcharge_core/motion/vehicle_rates.h"
#include "vcharge_features/feature_extractor.h"
#include "vcharge_features/place_index.h"
#include "vcharge_geometry/robust/robust_options.h"
#include "vcharge_reconstruction/localization_status.h"
#include "vcharge_reconstruction/tiled_map.h"

namespace vcharge {

struct MapLocalizerOptions {
  VCHARGE_BEGIN_OPTIONS(MapLocalizerOptions);
  VCHARGE_OPTION(int, min_inliers, 20, atLeast(6), "Least inliers of a pose near the expected one.");
  VCHARGE_OPTION(double, min_inlier_ratio, 0.15, between(0.0, 1.0), "Least inlier ratio of a pose.");
  VCHARGE_OPTION(double, max_sigma_m, 0.2, positive(), "Largest deviation of a position.");
  VCHARGE_OPTION(double, max_sigma_rad, 0.02, positive(), "Largest deviation of a rotation.");
  VCHARGE_OPTION(double, max_distance_m, 8.0, positive(),
                 "Distance of keyframes whose landmarks are searched.");
  VCHARGE_OPTION(int, max_keyframes, 16, atLeast(1), "Number of keyframes whose landmarks are searched.");
  VCHARGE_OPTION(double, max_radius_px, 60.0, atLeast(6.0), "Search radius in an image 1280 pixels wide.");
  VCHARGE_OPTION(bool, stands_upright, true, anyValue(),
                 "Whether the vehicle stands on the ground as in the map.");
  VCHARGE_OPTION(int, max_places, 12, atLeast(1), "Candidates of relocalization.");
  VCHARGE_OPTION(int, min_inliers_without_prior, 30, atLeast(6), "Least inliers of a relocalization.");
  VCHARGE_OPTION(int, min_inliers_per_camera_without_prior, 15, atLeast(0),
                 "The same per camera with an image.");
  VCHARGE_OPTION(double, max_ambiguity, 0.7, above(0.0).upTo(1.0),
                 "Inliers of the second best over the best pose.");
  VCHARGE_END_OPTIONS();

  /// Least inliers of a relocalization with images of that many cameras.
  int minInliersWithoutPrior(int num_cameras) const {
    return std::max(min_inliers_without_prior, min_inliers_per_camera_without_prior * num_cameras);
  }
};

/// Expected pose of the vehicle.
struct PosePrior {
  RigidTransform map_from_vehicle;
  Eigen::Matrix<double, 6, 6> covariance = Eigen::Matrix<double, 6, 6>::Zero();  ///< [dt, dphi], map's frame
};

/// A landmark of the map observed in the image of a camera.
struct LandmarkObservation {
  int32_t landmark_id = 0;
  int32_t camera = 0;
  cv::Point2f position_px;
  Eigen::Vector3d landmark_m = Eigen::Vector3d::Zero();  ///< in the map frame
  int32_t num_drives = 1;  ///< drives of the map that saw the landmark near here
};

/// Pose of the vehicle from the images of one instant. Pose and covariance are valid for kLocalized; for
/// kAmbiguous they are those of the better pose.
struct PoseFix {
  LocalizationStatus status = LocalizationStatus::kTooFewMatches;
  RigidTransform map_from_vehicle;
  Eigen::Matrix<double, 6, 6> covariance = Eigen::Matrix<double, 6, 6>::Zero();  ///< [dt, dphi], map's frame
  int num_matches = 0;
  std::vector<int> matches_of_camera, inliers_of_camera;
  std::vector<LandmarkObservation> inliers;
  /// Variance of the map's error here over that of one drive's map: drives have independent errors, so that
  /// the mean over n drives has one n-th.
  double map_variance_ratio = 1.0;
  double second_best_ratio = 0.0;  ///< inliers of the best pose elsewhere relative to these; 0 with a prior

  int numInliers() const { return static_cast<int>(inliers.size()); }
};

/// Features of the rig's images of one instant.
struct RigFeatures {
  std::vector<ImageFeatures> images;             ///< one per camera; empty for a missing image
  std::vector<Eigen::Matrix3Xd> rays_in_camera;  ///< bearings of the features; zero if a pixel has none
  FrameMotion motion;                            ///< of the vehicle at that instant
};

class LandmarkMatcher;
struct LandmarkMatches;

/// Finds the pose of a rig in a sparse map (paper, section Localization; Lee et al., IJRR 2015). Immutable,
/// and safe to use from several threads. Data parallel inside, deterministic. Localizing throws the errors of
/// the map's tiles.
class MapLocalizer {
 public:
  /// Localizers may share a map. The rig may differ from the map's in lenses and extrinsics.
  /// std::invalid_argument for bad options; InputError for a rig without extrinsics, or a map with features
  /// of an unknown kind.
  MapLocalizer(std::shared_ptr<const TiledMap> map, std::shared_ptr<const CameraRig> rig,
               const MapLocalizerOptions& options = MapLocalizerOptions());
  ~MapLocalizer();

  /// Extracts features of the map's kind. Images are in the rig's order, empty where one is missing.
  RigFeatures extract(const std::vector<Image>& images, const FrameMotion& motion) const;

  /// Tracking: searches for the landmarks in view of the expected pose, estimates the pose by generalized
  /// P3P, and repeats the search more narrowly around the result.
  PoseFix localizeNear(const RigFeatures& features, const PosePrior& prior) const;

  /// Relocalization: the best of the candidates of place recognition over the whole rig. Status kAmbiguous
  /// if two places fit the images.
  PoseFix localizeAnywhere(const RigFeatures& features) const;

  /// The poses at the candidates of place recognition that are different places, best first.
  std::vector<PoseFix> localizeEverywhere(const RigFeatures& features) const;
  /// Whether two poses of the vehicle belong to different places.
  static bool isOtherPlace(const RigidTransform& a, const RigidTransform& b);

  /// Minimum number of inliers of a relocalization with these images.
  int minInliersWithoutPrior(const RigFeatures& features) const;

  const std::shared_ptr<const TiledMap>& map() const { return map_; }

 private:
  /// A fix without a pose, with the numbers of matches filled in.
  PoseFix fixWithoutPose(const LandmarkMatches& matches) const;
  PoseFix estimate(const LandmarkMatches& matches, int min_inliers, double min_inlier_ratio) const;
  PoseFix refine(const RigFeatures& features, const PoseFix& fix, int min_inliers) const;
  std::vector<PlaceMatch> recognizePlaces(const RigFeatures& features) const;
  PoseFix localizeAtPlace(const RigFeatures& features, const PlaceMatch& place) const;

  const std::shared_ptr<const TiledMap> map_;
  const std::shared_ptr<const CameraRig> rig_;
  const MapLocalizerOptions options_;
  RobustOptions robust_;  // adapted to the resolution of the rig's images
  std::unique_ptr<FeatureExtractor> extractor_;
  std::vector<cv::Mat> masks_;  // one per camera
  std::unique_ptr<LandmarkMatcher> matcher_;
};

}  // namespace vcharge
