#pragma once

#include <algorithm>
#include <deque>
#include <functional>
#include <map>
#include <optional>
#include <utility>
#include <vector>

#include "vcharge_core/base/error.h"
#include "vcharge_core/frames/drive_odometry.h"
#include "vcharge_core/frames/drive_source.h"
#include "vcharge_core/frames/image.h"

namespace vcharge {

/// Pose of a frame that was handed out with another one, before the odometry corrected it.
struct CorrectedPose {
  Timestamp stamp;
  RigidTransform odom_from_vehicle;
  RigidTransform bridged_from_vehicle;
  RigidTransform old_vehicle_from_vehicle;  ///< the correction itself
};

/// The pose that a correction gives the frame at this stamp; null without one.
inline const CorrectedPose* correctionAt(const std::vector<CorrectedPose>& corrections, Timestamp stamp) {
  for (const CorrectedPose& corrected : corrections) {
    if (corrected.stamp == stamp) {
      return &corrected;
    }
  }
  return nullptr;
}

/// Images of one stamp and the pose of the vehicle at that time. An ImageType is the data of one camera: gray
/// pixels, or something computed from them.
template <class ImageType>
struct AssembledFrame {
  Timestamp stamp;
  std::vector<ImageType> images;  ///< in the rig's order; default-constructed where a camera sent none
  std::vector<bool> has_image;    ///< one per camera
  /// Pose as counted by the odometer; absent inside gaps, across resets, or if no odometry came in time.
  std::optional<RigidTransform> odom_from_vehicle;
  /// Pose in a frame without jumps: resets of the odometer are bridged by the velocities before them.
  std::optional<RigidTransform> bridged_from_vehicle;
  VehicleRates rates;  ///< where there is a pose
  /// Reason why there is no pose.
  OdometryBuffer::LookupStatus odometry_status = OdometryBuffer::LookupStatus::kEmpty;
  int64_t num_resets = 0;  ///< resets of the odometer before this frame
  /// Frames of the last second whose poses changed since the previous frame, in order of stamps. The pose at
  /// an image's stamp is extrapolated if the wheels' data are late; the next message corrects it.
  std::vector<CorrectedPose> corrections;
};
using ImageFrame = AssembledFrame<Image>;

/// Input of every stage that processes frames: combines images of one stamp with the odometry at that stamp,
/// in order of stamps.
///
/// A frame is handed out when odometry reaches it and all cameras have sent their image. It does not wait for
/// cameras that have sent a later image or are silent, nor for any camera longer than max_camera_wait_s; it
/// waits for odometry for at most max_odometry_wait_s. Where cameras are announced by expect(), it waits for
/// those alone. At most kMaxWaiting frames wait. An image that arrives after its frame was handed out is
/// late: it is dropped and counted. At a break (see DriveBreak) all older frames are handed out, then
/// `on_break` is called. With `on_break`, older images that arrive after a break are late, too, since the
/// stage has started again. Not thread safe.
template <class ImageType>
class FrameAssembler {
 public:
  using Frame = AssembledFrame<ImageType>;
  using FrameCallback = std::function<void(Frame)>;
  /// Receives the break and the first stamp after it.
  using BreakCallback = std::function<void(DriveBreak, Timestamp)>;
  static constexpr size_t kMaxWaiting = 25;  // two seconds at 12.5 Hz

  /// `is_used`: one per camera, false for cameras that send nothing; empty if all send. Throws
  /// std::invalid_argument for bad options.
  FrameAssembler(size_t num_cameras, const FrameAssemblerOptions& options, FrameCallback on_frame,
                 BreakCallback on_break = BreakCallback(), std::vector<bool> is_used = {})
      : options_(options),
        on_frame_(std::move(on_frame)),
        on_break_(std::move(on_break)),
        is_used_(is_used.empty() ? std::vector<bool>(num_cameras, true) : std::move(is_used)),
        num_used_(static_cast<size_t>(std::count(is_used_.begin(), is_used_.end(), true))),
        odometry_(options),
        newest_of_camera_(num_cameras),
        stamps_since_(num_cameras, 0),
        counters_(num_cameras) {
    check(num_used_ > 0, "FrameAssembler: expected cameras");
  }

  /// Takes the poses from this trajectory instead of from the odometry.
  void setTrajectory(const Trajectory& odom_from_vehicle) { odometry_.setTrajectory(odom_from_vehicle); }

  /// Keeps the first pose of every stamp, for stages whose images come so late that it depends on the load
  /// whether a correction comes before or after them.
  void ignoreCorrections() { odometry_.ignoreCorrections(); }

  /// Returns false if the image is late and was dropped.
  bool addImage(size_t camera_index, Timestamp stamp, ImageType image);
  void addOdometry(const VehicleOdometry& odometry);
  /// Waits at this stamp for no camera but these (one per camera), which are announced to send an image.
  void expect(Timestamp stamp, std::vector<bool> cameras);
  /// Hands out all waiting frames at the end of the drive.
  void finish() { handOut(std::nullopt); }

  const FrameCounters& counters() const { return counters_; }
  const DriveOdometry& odometry() const { return odometry_; }
  size_t numWaiting() const { return pending_.size(); }
  /// Stamp of the frame that has waited longest for odometry, if it has waited for longer than a gap may be.
  std::optional<Timestamp> lacksOdometryAt() const;
  std::optional<Timestamp> newestImage() const { return newest_image_; }
  std::optional<Timestamp> newestImage(size_t camera_index) const { return newest_of_camera_[camera_index]; }
  /// Whether a camera sends no images while other cameras send theirs.
  bool isSilent(size_t camera_index) const {
    return stamps_since_[camera_index] > options_.silent_after_frames;
  }

 private:
  struct Pending {
    std::vector<ImageType> images;
    std::vector<bool> has_image;
    size_t num_images = 0;
    Timestamp begun;  // start of waiting, on the drive's clock
  };

  static constexpr double kReplay_s = 1.0;
  static constexpr double kCorrectable_s = 1.0;
  Timestamp clock() const {
    const std::optional<VehicleOdometry>& last = odometry_.last();
    return last && !(newest_image_ && *newest_image_ > last->stamp) ? last->stamp : *newest_image_;
  }
  bool hasImages(Timestamp stamp, const Pending& pending) const;
  bool isReady(Timestamp stamp, const Pending& pending) const;
  void handOutReady();
  /// Hands out all frames before a stamp, or all frames.
  void handOut(std::optional<Timestamp> before);
  void handOutFirst();
  std::vector<CorrectedPose> takeCorrections();
  void startOver();

  const FrameAssemblerOptions options_;
  const FrameCallback on_frame_;
  const BreakCallback on_break_;
  const std::vector<bool> is_used_;
  const size_t num_used_;
  DriveOdometry odometry_;
  std::map<Timestamp, Pending> pending_;
  std::map<Timestamp, std::vector<bool>> expected_;  // where announced, after last_closed_
  std::optional<Timestamp> newest_image_;
  std::vector<std::optional<Timestamp>> newest_of_camera_;
  std::vector<int> stamps_since_;         // per camera: stamps that came since its last image
  std::optional<Timestamp> last_closed_;  // images up to this stamp are late
  std::deque<CorrectedPose> handed_out_;  // poses of the frames of the last kCorrectable_s
  int64_t num_corrections_ = 0;           // corrections of the odometry that handed_out_ has
  FrameCounters counters_;
};

/// FrameAssembler for a DriveSource.
class ImageFrameAssembler : public DriveConsumer, public FrameAssembler<Image> {
 public:
  using FrameAssembler<Image>::FrameAssembler;
  void addImage(size_t camera_index, Timestamp stamp, const Image& image) override {
    FrameAssembler<Image>::addImage(camera_index, stamp, image);
  }
  void addOdometry(const VehicleOdometry& odometry) override { FrameAssembler<Image>::addOdometry(odometry); }
};

template <class ImageType>
bool FrameAssembler<ImageType>::addImage(size_t camera_index, Timestamp stamp, ImageType image) {
  check(camera_index < is_used_.size() && is_used_[camera_index], "FrameAssembler::addImage: bad camera");
  const std::optional<Timestamp> last = newest_of_camera_[camera_index];
  if (last && toSeconds(*last - stamp) > kReplay_s) {
    startOver();
    if (on_break_) {
      on_break_(DriveBreak::kReplay, stamp);
    }
  }
  if (last_closed_ && stamp <= *last_closed_) {
    ++counters_.late_images[camera_index];
    return false;
  }
  newest_image_ = newest_image_ ? std::max(*newest_image_, stamp) : stamp;
  std::optional<Timestamp>& newest = newest_of_camera_[camera_index];
  newest = newest ? std::max(*newest, stamp) : stamp;
  const auto [entry, is_new] = pending_.try_emplace(stamp);
  Pending& pending = entry->second;
  if (is_new) {
    pending.images.resize(is_used_.size());
    pending.has_image.assign(is_used_.size(), false);
    pending.begun = clock();
    for (int& stamps : stamps_since_) {
      ++stamps;
    }
  }
  stamps_since_[camera_index] = 0;
  const bool is_repeated = pending.has_image[camera_index];
  if (is_repeated) {
    ++counters_.late_images[camera_index];
  } else {
    pending.images[camera_index] = std::move(image);
    pending.has_image[camera_index] = true;
    ++pending.num_images;
  }
  handOutReady();
  return !is_repeated;
}

template <class ImageType>
void FrameAssembler<ImageType>::addOdometry(const VehicleOdometry& odometry) {
  if (odometry_.isGiven()) {
    return;
  }
  std::optional<DriveBreak> found;
  if (odometry_.jumpsBack(odometry.stamp)) {
    startOver();
    found = DriveBreak::kReplay;
  }
  if (const std::optional<DriveBreak> broken = odometry_.add(odometry, &counters_)) {
    handOut(odometry.stamp);
    if (on_break_) {
      const Timestamp last_late = odometry.stamp - Duration(1);
      last_closed_ = last_closed_ ? std::max(*last_closed_, last_late) : last_late;
    }
    found = broken;
  }
  if (found && on_break_) {
    on_break_(*found, odometry.stamp);
  }
  handOutReady();
}

template <class ImageType>
void FrameAssembler<ImageType>::expect(Timestamp stamp, std::vector<bool> cameras) {
  check(cameras.size() == is_used_.size(), "FrameAssembler::expect: expected one value per camera");
  if (!last_closed_ || stamp > *last_closed_) {
    expected_[stamp] = std::move(cameras);
    handOutReady();
  }
}

template <class ImageType>
bool FrameAssembler<ImageType>::hasImages(Timestamp stamp, const Pending& pending) const {
  if (pending.num_images == num_used_ || toSeconds(clock() - pending.begun) > options_.max_camera_wait_s) {
    return true;
  }
  const auto announced = expected_.find(stamp);
  for (size_t camera = 0; camera < is_used_.size(); ++camera) {
    if (announced != expected_.end() && !announced->second[camera]) {
      continue;
    }
    const std::optional<Timestamp>& newest = newest_of_camera_[camera];
    const bool has_passed = newest && *newest > stamp;
    // A silent camera may resume with this frame: when waiting for everything, only newer images exclude it.
    const bool is_absent = isSilent(camera) && (!options_.waitsForEverything() || *newest_image_ > stamp);
    if (is_used_[camera] && !pending.has_image[camera] && !has_passed && !is_absent) {
      return false;
    }
  }
  return true;
}

template <class ImageType>
bool FrameAssembler<ImageType>::isReady(Timestamp stamp, const Pending& pending) const {
  return hasImages(stamp, pending) &&
         (odometry_.reaches(stamp) || toSeconds(clock() - pending.begun) > options_.max_odometry_wait_s);
}

template <class ImageType>
void FrameAssembler<ImageType>::handOutReady() {
  while (!pending_.empty() &&
         (pending_.size() > kMaxWaiting || isReady(pending_.begin()->first, pending_.begin()->second))) {
    handOutFirst();
  }
}

template <class ImageType>
void FrameAssembler<ImageType>::handOut(std::optional<Timestamp> before) {
  while (!pending_.empty() && (!before || pending_.begin()->first < *before)) {
    handOutFirst();
  }
}

template <class ImageType>
void FrameAssembler<ImageType>::handOutFirst() {
  const auto first = pending_.begin();
  Frame frame;
  frame.stamp = first->first;
  frame.images = std::move(first->second.images);
  frame.has_image = std::move(first->second.has_image);
  frame.num_resets = counters_.odometry_resets;
  const bool is_complete = first->second.num_images == num_used_;
  pending_.erase(first);
  ++counters_.frames;
  counters_.incomplete_frames += is_complete ? 0 : 1;
  for (size_t camera = 0; camera < is_used_.size(); ++camera) {
    counters_.missing_images[camera] += is_used_[camera] && !frame.has_image[camera] ? 1 : 0;
  }
  frame.corrections = takeCorrections();
  const OdometryBuffer::Lookup bridged = odometry_.lookupBridged(frame.stamp);
  frame.odometry_status = bridged.status;
  if (bridged) {
    frame.bridged_from_vehicle = bridged.odometry.odom_from_vehicle;
    frame.rates = bridged.odometry.rates();
    if (const OdometryBuffer::Lookup raw = odometry_.lookup(frame.stamp)) {
      frame.odom_from_vehicle = raw.odometry.odom_from_vehicle;
      handed_out_.push_back(
          {frame.stamp, *frame.odom_from_vehicle, *frame.bridged_from_vehicle, RigidTransform()});
    }
  } else {
    ++counters_.frames_without_odometry;
  }
  last_closed_ = frame.stamp;
  expected_.erase(expected_.begin(), expected_.upper_bound(frame.stamp));
  on_frame_(std::move(frame));
}

template <class ImageType>
std::vector<CorrectedPose> FrameAssembler<ImageType>::takeCorrections() {
  std::vector<CorrectedPose> corrections;
  const auto isSame = [](const RigidTransform& a, const RigidTransform& b) {
    return a.translation() == b.translation() && a.rotation().coeffs() == b.rotation().coeffs();
  };
  if (counters_.odometry_corrections != num_corrections_) {
    for (CorrectedPose& pose : handed_out_) {
      const OdometryBuffer::Lookup raw = odometry_.lookup(pose.stamp);
      const OdometryBuffer::Lookup bridged = odometry_.lookupBridged(pose.stamp);
      if (raw && bridged && !isSame(raw.odometry.odom_from_vehicle, pose.odom_from_vehicle)) {
        pose = {pose.stamp, raw.odometry.odom_from_vehicle, bridged.odometry.odom_from_vehicle,
                pose.bridged_from_vehicle.inverse() * bridged.odometry.odom_from_vehicle};
        corrections.push_back(pose);
      }
    }
    num_corrections_ = counters_.odometry_corrections;
  }
  while (!handed_out_.empty() &&
         toSeconds(handed_out_.back().stamp - handed_out_.front().stamp) > kCorrectable_s) {
    handed_out_.pop_front();
  }
  return corrections;
}

template <class ImageType>
void FrameAssembler<ImageType>::startOver() {
  handOut(std::nullopt);
  handed_out_.clear();
  newest_image_.reset();
  last_closed_.reset();
  expected_.clear();
  std::fill(newest_of_camera_.begin(), newest_of_camera_.end(), std::nullopt);
  std::fill(stamps_since_.begin(), stamps_since_.end(), 0);
  if (!odometry_.isGiven()) {
    odometry_.clear();
  }
  ++counters_.replays;
}

template <class ImageType>
std::optional<Timestamp> FrameAssembler<ImageType>::lacksOdometryAt() const {
  if (pending_.empty() || odometry_.reaches(pending_.begin()->first) ||
      toSeconds(clock() - pending_.begin()->second.begun) <= options_.max_odometry_gap_s) {
    return std::nullopt;
  }
  return pending_.begin()->first;
}

}  // namespace vcharge
