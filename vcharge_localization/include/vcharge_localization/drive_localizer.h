#pragma once

#include <map>
#include <memory>
#include <optional>
#include <string>
#include <vector>

#include "vcharge_core/base/options.h"
#include "vcharge_localization/camera_health.h"
#include "vcharge_localization/frame_assembler.h"
#include "vcharge_localization/pose_filter.h"
#include "vcharge_reconstruction/map_localizer.h"

namespace vcharge {

struct DriveLocalizerOptions {
  FrameAssemblerOptions frames;
  MapLocalizerOptions localizer;
  PoseFilterOptions filter;
  CameraHealthOptions health;
  double lost_sigma_m = 1.0;  ///< a pose whose position is less certain is lost
  double lost_sigma_rad = 0.1;
  /// Frames in a row without a fix that fits, before the whole map is searched, and between such searches.
  int max_frames_without_fix = 5;
  /// Poses of place recognition are believed once two frames agree, but for this much.
  double confirmation_m = 0.3;
  double confirmation_rad = 0.03;
  double max_confirmation_s = 1.0;  ///< between the two
  // Motion that no odometer counted: besides going on as before, it may differ by this much.
  double unknown_motion_m_per_s = 1.0;
  double unknown_turn_rad_per_s = 0.3;

  template <class Visitor>
  void visitFields(Visitor&& visit) {
    visit("frames", frames);
    visit("localizer", localizer);
    visit("filter", filter);
    visit("health", health);
    visit("lost_sigma_m", lost_sigma_m);
    visit("lost_sigma_rad", lost_sigma_rad);
    visit("max_frames_without_fix", max_frames_without_fix);
    visit("confirmation_m", confirmation_m);
    visit("confirmation_rad", confirmation_rad);
    visit("max_confirmation_s", max_confirmation_s);
    visit("unknown_motion_m_per_s", unknown_motion_m_per_s);
    visit("unknown_turn_rad_per_s", unknown_turn_rad_per_s);
  }
  void validate() const;  ///< throws std::invalid_argument naming the field
};

/// What is known at a frame, from that frame and those before it alone.
struct LocalizationResult {
  Timestamp stamp;
  LocalizationStatus status = LocalizationStatus::kLost;
  std::optional<PosePrior> pose;  ///< for kLocalized and kBridgedByOdometry
  PoseFix fix;                    ///< by this frame's images alone
  bool searched_whole_map = false;
  double fix_distance = 0.0;  ///< squared Mahalanobis distance of the fix to what was expected
  double since_fix_s = 0.0;   ///< 0 for kLocalized; infinite before the first
  std::optional<RigidTransform> odom_from_vehicle;
  std::string message;  ///< for people: what happens, and why
  std::vector<std::string> camera_warnings;
  std::map<std::string, double> stage_s;
};

/// Follows a vehicle through a map, frame by frame: images fix its pose where they can, the odometer bridges
/// the rest, and where both have failed place recognition finds it again. Not thread safe.
class DriveLocalizer {
 public:
  /// Errors as MapLocalizer.
  DriveLocalizer(std::shared_ptr<const SparseMap> map, std::shared_ptr<const CameraRig> rig,
                 const DriveLocalizerOptions& options = DriveLocalizerOptions());

  LocalizationResult process(const LocalizationFrame& frame);
  /// The same where the frame's features are known; its images are not looked at.
  LocalizationResult process(const LocalizationFrame& frame, const RigFeatures& features);

  /// Somebody says where the vehicle is now; the next frames tell whether that is right, and until then there
  /// is no pose. After max_frames_without_fix the whole map is searched.
  void seed(const PosePrior& pose);

  /// As if this were the first frame.
  void forget();

  const MapLocalizer& localizer() const { return localizer_; }

 private:
  struct Candidate {
    Timestamp stamp;
    RigidTransform map_from_vehicle;
    std::optional<RigidTransform> odom_from_vehicle;
  };
  void localize(const LocalizationFrame& frame, const RigFeatures& features, LocalizationResult* result);
  void predict(const LocalizationFrame& frame);
  bool isLost() const;
  void track(const RigFeatures& features, LocalizationResult* result);
  void searchWholeMap(const LocalizationFrame& frame, const RigFeatures& features,
                      LocalizationResult* result);
  /// Where the vehicle is by a recognized place that is not confirmed yet; none, or too old: nothing.
  std::optional<RigidTransform> candidateNow(const LocalizationFrame& frame) const;
  bool isConfirmed(const RigidTransform& expected, const PoseFix& fix) const;
  PoseFix searchFrom(const std::optional<RigidTransform>& expected, const RigFeatures& features) const;
  void takeFix(const PoseFix& fix, LocalizationResult* result);

  const std::shared_ptr<const CameraRig> rig_;
  const DriveLocalizerOptions options_;
  const MapLocalizer localizer_;
  PoseFilter filter_;
  CameraHealth health_;
  std::optional<Timestamp> last_stamp_, last_fix_;
  std::optional<RigidTransform> last_odom_from_vehicle_;
  int64_t last_num_resets_ = 0;
  RigidTransform last_motion_;
  double last_period_s_ = 0.0;
  int frames_without_fix_ = 0;
  bool is_seed_ = false;  // what the filter has was told, and no image confirmed it
  std::optional<Candidate> candidate_;
};

}  // namespace vcharge
