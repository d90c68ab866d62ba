#pragma once

#include <cstdint>
#include <memory>
#include <vector>

#include <Eigen/Core>

#include "vcharge_core/base/options.h"
#include "vcharge_core/camera/camera_rig.h"
#include "vcharge_core/frames/image.h"
#include "vcharge_core/sparse_map/sparse_map.h"
#include "vcharge_features/descriptor_matching.h"
#include "vcharge_features/feature_extractor.h"
#include "vcharge_features/place_votes.h"
#include "vcharge_geometry/robust/robust_options.h"
#include "vcharge_reconstruction/localization_status.h"

namespace vcharge {

struct MapLocalizerOptions {
  int min_inliers = 20;  ///< the paper's
  /// Of all matches that guided search found, those that the pose must explain: about twice as many as fit
  /// any pose by chance, since a match is off by no more than the search's radius.
  double min_inlier_ratio = 0.15;
  double max_sigma_m = 0.2;  ///< a less certain pose is no fix
  double max_sigma_rad = 0.02;
  // Guided search: landmarks that the nearest keyframes saw, where they are expected.
  double max_distance_m = 8.0;  ///< of keyframes
  int max_keyframes = 16;
  double max_view_angle_rad = 0.6;  ///< between the directions from which a landmark is seen
  double max_range_ratio = 1.8;     ///< between the distances
  /// Of search, at 1280 pixels of width; also of the second search. Never below 3 pixels of the image.
  double min_radius_px = 6.0;
  double max_radius_px = 60.0;
  double radius_sigmas = 3.0;  ///< of the expected pose
  /// Of the descriptors of a match, over the median distance between two landmarks of the map: the same for
  /// all kinds of descriptors.
  double max_relative_distance = 0.55;
  MatchOptions matching = closeMatches();
  // Place recognition.
  /// The vehicle stands on the ground as the map's did, which makes a recognized place easier to believe.
  /// False for a camera that is looked for without knowing how it is mounted.
  bool stands_upright = true;
  PlaceVotesOptions places;
  int max_places = 12;                 ///< candidates
  double place_spacing_m = 2.5;        ///< candidates nearer to a better one are left out
  double place_spacing_rad = 0.6;      ///< unless they are turned by more
  double place_max_error_rad = 0.012;  ///< of a match with a recognized place, by a pose that is upright
  int min_inliers_without_prior = 30;  ///< in the wide search about it
  /// Besides, on average over the cameras that sent an image: a place that has only its pillars in common
  /// with another, or with itself long ago, is not believed.
  int min_inliers_per_camera_without_prior = 15;
  double max_ambiguity = 0.7;      ///< inliers of the second best place over those of the best
  double other_place_m = 1.0;      ///< poses further apart are of two places
  double other_heading_rad = 0.1;  ///< or turned by more
  MatchOptions place_matching;
  RobustOptions robust = defaultRobust();
  /// Of the coarsest camera: robust.max_error_rad is not taken for less, since no feature is more exact.
  double min_error_px = 0.8;

  static MatchOptions closeMatches();
  static RobustOptions defaultRobust();

  template <class Visitor>
  void visitFields(Visitor&& visit) {
    visit("min_inliers", min_inliers);
    visit("min_inlier_ratio", min_inlier_ratio);
    visit("max_sigma_m", max_sigma_m);
    visit("max_sigma_rad", max_sigma_rad);
    visit("max_distance_m", max_distance_m);
    visit("max_keyframes", max_keyframes);
    visit("max_view_angle_rad", max_view_angle_rad);
    visit("max_range_ratio", max_range_ratio);
    visit("min_radius_px", min_radius_px);
    visit("max_radius_px", max_radius_px);
    visit("radius_sigmas", radius_sigmas);
    visit("max_relative_distance", max_relative_distance);
    visit("matching", matching);
    visit("stands_upright", stands_upright);
    visit("places", places);
    visit("max_places", max_places);
    visit("place_spacing_m", place_spacing_m);
    visit("place_spacing_rad", place_spacing_rad);
    visit("place_max_error_rad", place_max_error_rad);
    visit("min_inliers_without_prior", min_inliers_without_prior);
    visit("min_inliers_per_camera_without_prior", min_inliers_per_camera_without_prior);
    visit("max_ambiguity", max_ambiguity);
    visit("other_place_m", other_place_m);
    visit("other_heading_rad", other_heading_rad);
    visit("place_matching", place_matching);
    visit("robust", robust);
    visit("min_error_px", min_error_px);
  }
  void validate() const;  ///< throws std::invalid_argument naming the field
};

/// Where the vehicle is expected.
struct PosePrior {
  RigidTransform map_from_vehicle;
  Eigen::Matrix<double, 6, 6> covariance = Eigen::Matrix<double, 6, 6>::Zero();  ///< [dt, dphi], map's frame
};

/// A landmark and the ray along which a camera sees it.
struct LandmarkSighting {
  int32_t landmark = 0;
  int32_t camera = 0;
  cv::Point2f position_px;
};

/// The vehicle's pose by the images of one instant. Pose and covariance are filled for kLocalized and
/// kAmbiguous (the better one).
struct PoseFix {
  LocalizationStatus status = LocalizationStatus::kTooFewMatches;
  RigidTransform map_from_vehicle;
  Eigen::Matrix<double, 6, 6> covariance = Eigen::Matrix<double, 6, 6>::Zero();  ///< [dt, dphi], map's frame
  int num_matches = 0;
  std::vector<int> matches_of_camera, inliers_of_camera;
  std::vector<LandmarkSighting> inliers;
  double second_best_ratio = 0.0;  ///< inliers of the best other place over these; 0 with a prior

  int numInliers() const { return static_cast<int>(inliers.size()); }
};

/// What the rig's cameras show at one instant.
struct RigFeatures {
  std::vector<ImageFeatures> images;             ///< by camera; empty where one sent no image
  std::vector<Eigen::Matrix3Xd> rays_in_camera;  ///< unit rays of the features; zero where there is none
};

class LandmarkMatcher;
struct LandmarkMatches;

/// Finds a rig's pose in a sparse map (paper, section Localization; Lee et al., IJRR 2015). Immutable; any
/// number of threads may use it at once. Data parallel inside, deterministic.
class MapLocalizer {
 public:
  /// The rig may differ from the map's; its cameras may have other lenses and places.
  /// std::invalid_argument for bad options; InputError for a rig without extrinsics, or a map that no
  /// extractor of this program can have made.
  MapLocalizer(std::shared_ptr<const SparseMap> map, std::shared_ptr<const CameraRig> rig,
               const MapLocalizerOptions& options = MapLocalizerOptions());
  ~MapLocalizer();

  /// The same for another rig, without preparing the map anew. Errors as those of the constructor.
  std::unique_ptr<MapLocalizer> forRig(std::shared_ptr<const CameraRig> rig) const;

  /// Features as the map has them; images in the rig's order, empty ones where a camera sent none.
  RigFeatures extract(const std::vector<Image>& images) const;

  /// Guided search for the landmarks that are expected in view, generalized P3P among what was found, and a
  /// second, narrower search about the result.
  PoseFix localizeNear(const RigFeatures& features, const PosePrior& prior) const;

  /// Place recognition over the whole rig, and the best of the candidates. Status kAmbiguous where two
  /// places fit.
  PoseFix localizeAnywhere(const RigFeatures& features) const;

  /// Inliers that a pose needs to be believed by who knew nothing before.
  int minInliersWithoutPrior(const RigFeatures& features) const;

  const SparseMap& map() const { return *map_; }

 private:
  MapLocalizer(std::shared_ptr<const SparseMap> map, std::shared_ptr<const CameraRig> rig,
               const MapLocalizerOptions& options, std::shared_ptr<const PlaceVotes> places);

  /// A fix without a pose, with the counts of the matches.
  PoseFix fixWithoutPose(const LandmarkMatches& matches) const;
  PoseFix estimate(const LandmarkMatches& matches, int min_inliers, double min_inlier_ratio) const;
  PoseFix refine(const RigFeatures& features, const PoseFix& fix, int min_inliers) const;
  std::vector<PlaceMatch> recognizePlaces(const RigFeatures& features) const;
  PoseFix localizeAtPlace(const RigFeatures& features, const PlaceMatch& place) const;
  bool isOtherPlace(const PoseFix& a, const PoseFix& b) const;

  const std::shared_ptr<const SparseMap> map_;
  const std::shared_ptr<const CameraRig> rig_;
  const MapLocalizerOptions options_;
  RobustOptions robust_;  // the options', for the rig's pixels
  std::unique_ptr<FeatureExtractor> extractor_;
  std::vector<cv::Mat> masks_;  // by camera
  std::unique_ptr<LandmarkMatcher> matcher_;
  std::shared_ptr<const PlaceVotes> places_;
};

}  // namespace vcharge
