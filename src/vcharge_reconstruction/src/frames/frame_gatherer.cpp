#include "vcharge_reconstruction/frame_gatherer.h"

#include <utility>

#include "vcharge_core/base/error.h"

namespace vcharge {
namespace {

/// Frames that may wait for odometry.
constexpr size_t kMaxWaitingFrames = 32;
/// An incomplete frame is ready once images of this many stamps, its own included, arrived.
constexpr size_t kStampsForIncomplete = 3;

}  // namespace

FrameGatherer::FrameGatherer(std::shared_ptr<const CameraRig> rig, double max_speed_m_per_s,
                             ReconstructionReport* report, FrameCallback on_frame)
    : rig_(std::move(rig)),
      max_speed_m_per_s_(max_speed_m_per_s),
      report_(report),
      on_frame_(std::move(on_frame)) {
  report_->num_missing_images.assign(rig_->cameras.size(), 0);
}

void FrameGatherer::addOdometry(const VehicleOdometry& odometry) {
  // A reset makes the pose jump: bridge it with the motion of the velocities.
  if (last_raw_odometry_ && odometry.stamp > last_raw_odometry_->stamp) {
    const double period_s = toSeconds(odometry.stamp - last_raw_odometry_->stamp);
    const RigidTransform motion =
        last_raw_odometry_->odom_from_vehicle.inverse() * odometry.odom_from_vehicle;
    if (motion.translation().norm() > max_speed_m_per_s_ * period_s + 0.1) {
      ++report_->num_odometry_resets;
      const RigidTransform likely =
          RigidTransform::planar(last_raw_odometry_->forward_speed_m_per_s * period_s, 0.0,
                                 last_raw_odometry_->yaw_rate_rad_per_s * period_s);
      corrected_from_raw_odom_ = corrected_from_raw_odom_ * last_raw_odometry_->odom_from_vehicle * likely *
                                 odometry.odom_from_vehicle.inverse();
    }
  }
  last_raw_odometry_ = odometry;
  VehicleOdometry corrected = odometry;
  corrected.odom_from_vehicle = corrected_from_raw_odom_ * odometry.odom_from_vehicle;
  odometry_.add(corrected);
  processFrames(false);
}

void FrameGatherer::addImage(size_t camera_index, Timestamp stamp, const Image& image) {
  check(camera_index < rig_->cameras.size(), "FrameGatherer::addImage: bad camera");
  if (last_stamp_ && stamp <= *last_stamp_) {
    ++report_->num_late_images;
    return;
  }
  PendingFrame& frame = pending_[stamp];
  frame.images.resize(rig_->cameras.size());
  if (frame.images[camera_index].pixels.empty()) {
    frame.images[camera_index] = image;
    ++frame.num_present;
  }
  processFrames(false);
}

void FrameGatherer::processFrames(bool all) {
  // A frame is ready once it is complete or later images arrived, and odometry reaches it.
  while (!pending_.empty()) {
    const auto first = pending_.begin();
    const Timestamp stamp = first->first;
    const bool is_complete = first->second.num_present == rig_->cameras.size();
    const auto newest = odometry_.newestStamp();
    const bool has_images = is_complete || pending_.size() >= kStampsForIncomplete;
    const bool has_odometry = newest && *newest >= stamp;
    const bool waited_too_long = !has_odometry && pending_.size() >= kMaxWaitingFrames;
    if (!all && !(has_images && has_odometry) && !waited_too_long) {
      return;
    }
    const PendingFrame frame = std::move(first->second);
    pending_.erase(first);
    last_stamp_ = stamp;
    ++report_->num_frames;
    if (!is_complete) {
      ++report_->num_incomplete_frames;
      noteSkipped(stamp, missingCameras(frame));
    }
    const OdometryBuffer::Lookup lookup = odometry_.lookup(stamp);
    if (!lookup) {
      ++report_->num_frames_without_odometry;
      noteSkipped(stamp, describe(lookup.status));
      continue;
    }
    on_frame_(stamp, frame.images, lookup.odometry.odom_from_vehicle);
  }
}

std::string FrameGatherer::missingCameras(const PendingFrame& frame) {
  std::string names;
  for (size_t i = 0; i < frame.images.size(); ++i) {
    if (frame.images[i].pixels.empty()) {
      ++report_->num_missing_images[i];
      names += (names.empty() ? "without camera " : ", ") + rig_->cameras[i].name;
    }
  }
  return names;
}

void FrameGatherer::noteSkipped(Timestamp stamp, const std::string& reason) {
  std::vector<SkippedFrames>& skipped = report_->skipped;
  const auto [last, is_new] = last_skipped_.try_emplace(reason);
  if (is_new || last->second.frame + 1 < report_->num_frames) {
    last->second.entry = skipped.size();
    skipped.push_back({reason, stamp, stamp, 0});
  }
  last->second.frame = report_->num_frames;
  skipped[last->second.entry].last = stamp;
  ++skipped[last->second.entry].num_frames;
}

}  // namespace vcharge
