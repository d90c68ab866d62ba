#include "vcharge_recordings/drive_check.h"

#include <algorithm>
#include <map>

#include "check/check_findings.h"
#include "check/image_check.h"
#include "check/image_motion.h"
#include "check/odometry_check.h"
#include "check/stamp_check.h"
#include "vcharge_core/base/error.h"

namespace vcharge {
namespace {

using internal::CheckFindings;

constexpr double kMaxImageGap_s = 2.0;
constexpr double kMaxOdometryGap_s = 0.25;
/// Motion in the image after which a static edge belongs to the vehicle.
constexpr double kMoved_px = 3.0;

}  // namespace

const char* toString(CheckGrade grade) {
  return grade == CheckGrade::kPass ? "PASS" : grade == CheckGrade::kWarn ? "WARN" : "FAIL";
}

CheckGrade worstGrade(const std::vector<CheckFinding>& findings) {
  CheckGrade worst = CheckGrade::kPass;
  for (const CheckFinding& finding : findings) {
    worst = std::max(worst, finding.grade);
  }
  return worst;
}

struct DriveChecker::State {
  struct Broken {
    int64_t count = 0;
    std::string first;
  };

  explicit State(std::shared_ptr<const CameraRig> of_rig)
      : rig(std::move(of_rig)), times(rig->cameras.size()), motions(rig->cameras.size()) {
    for (const RigCamera& camera : rig->cameras) {
      images.emplace_back(camera);
      meters.emplace_back(camera);
    }
  }

  std::shared_ptr<const CameraRig> rig;
  std::vector<internal::TopicTimes> times;  // one per camera, like the three members below
  std::vector<internal::ImageCheck> images;
  std::vector<internal::ImageMotionMeter> meters;
  std::vector<std::vector<internal::ImageMotion>> motions;
  internal::TopicTimes odometry_times;
  std::vector<VehicleOdometry> odometry;
  std::map<std::string, Broken> broken;  // key: topic
};

DriveChecker::DriveChecker(std::shared_ptr<const CameraRig> rig)
    : state_([&] {
        check(rig != nullptr && !rig->cameras.empty(), "DriveChecker: expected a rig with cameras");
        return std::make_unique<State>(std::move(rig));
      }()) {}

DriveChecker::~DriveChecker() = default;

void DriveChecker::addImage(size_t camera_index, Timestamp stamp, Timestamp recorded, const Image& image) {
  check(camera_index < state_->times.size(), "DriveChecker::addImage: expected a camera of the rig");
  state_->times[camera_index].add(stamp, recorded);
  state_->images[camera_index].add(image.pixels);
  const auto motion = state_->meters[camera_index].add(stamp, image.pixels);
  if (motion) {
    state_->motions[camera_index].push_back(*motion);
    if (motion->flow_px > kMoved_px) {
      state_->images[camera_index].addMoved(image.pixels);
    }
  }
}

void DriveChecker::addOdometry(Timestamp recorded, const VehicleOdometry& odometry) {
  if (!state_->odometry.empty() && state_->odometry.back().stamp == odometry.stamp) {
    return;  // corrects an estimate that was extrapolated; the check judges what live stages receive first
  }
  state_->odometry_times.add(odometry.stamp, recorded);
  state_->odometry.push_back(odometry);
}

void DriveChecker::addBroken(const std::string& topic, const std::string& why) {
  State::Broken& broken = state_->broken[topic];
  if (broken.count++ == 0) {
    broken.first = why;
  }
}

std::vector<CheckFinding> DriveChecker::findings() const {
  CheckFindings findings;
  for (const auto& [topic, broken] : state_->broken) {
    findings.add(topic, CheckGrade::kFail,
                 std::to_string(broken.count) + " messages cannot be understood, the first: " + broken.first);
  }
  std::vector<std::vector<Timestamp>> stamps_by_camera;
  std::vector<Timestamp> most_stamps;  // stamps of the camera with the most images
  double period_s = 0.0;
  for (size_t i = 0; i < state_->times.size(); ++i) {
    const std::string& name = state_->rig->cameras[i].name;
    const internal::TopicTimes& times = state_->times[i];
    stamps_by_camera.push_back(times.sortedStamps());
    if (times.empty()) {
      findings.add(name, CheckGrade::kFail, "no images with stamps");
      continue;
    }
    if (stamps_by_camera.back().size() > most_stamps.size()) {
      most_stamps = stamps_by_camera.back();
    }
    period_s = std::max(period_s, times.period_s());
    times.judgeOrder(name, &findings);
    times.judgeRate(name, kMaxImageGap_s, &findings);
    state_->images[i].judge(&findings);
  }
  internal::judgeSync(stamps_by_camera, period_s, state_->rig->stamp_tolerance_s, &findings);
  if (state_->odometry_times.empty()) {
    findings.add("odometry", CheckGrade::kFail, "no odometry with stamps");
    return findings.take();
  }
  state_->odometry_times.judgeOrder("odometry", &findings);
  state_->odometry_times.judgeRate("odometry", kMaxOdometryGap_s, &findings);
  const internal::OdometryPath path(state_->odometry);
  internal::judgeOdometry(path, most_stamps, &findings);
  internal::judgeAgreement(path, *state_->rig, state_->motions, &findings);
  return findings.take();
}

}  // namespace vcharge
