#pragma once

#include <algorithm>
#include <deque>
#include <functional>
#include <map>
#include <optional>
#include <utility>
#include <vector>

#include "vcharge_core/base/error.h"
#include "vcharge_core/frames/assembled_frame.h"
#include "vcharge_core/frames/drive_odometry.h"
#include "vcharge_core/frames/drive_source.h"

namespace vcharge {

/// Input of every stage that processes frames: combines images of one stamp with the odometry at that stamp,
/// in order of stamps.
///
/// A frame is handed out when odometry reaches it and all cameras have sent their image. It does not wait for
/// cameras that have sent a later image or are silent, nor for any camera longer than max_camera_wait_s; it
/// waits for odometry for at most max_odometry_wait_s. Where cameras are announced by expect(), it waits for
/// those alone. At most kMaxWaiting frames wait. An image that arrives after its frame was handed out is
/// late: it is dropped and counted. At a break (see DriveBreak) all older frames are handed out, then
/// `on_break` is called. With `on_break`, older images that arrive after a break are late, too, since the
/// stage has started again.
///
/// Cameras without a common trigger: see joinStamps(). Not thread safe.
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
        earlier_(num_cameras),
        newest_of_camera_(num_cameras),
        stamps_since_(num_cameras, 0),
        counters_(num_cameras) {
    check(num_used_ > 0, "FrameAssembler: expected cameras");
  }

  /// Joins images whose stamps differ by at most this into a frame, each with its own stamp, for cameras that
  /// no common trigger starts. A frame has the stamp of the first camera that sends images; images of other
  /// cameras that come before it wait for it. Half a period joins all images of a period.
  void joinStamps(double tolerance_s) { tolerance_ = durationFromSeconds(tolerance_s); }

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
    std::vector<double> image_offsets_s;
    size_t num_images = 0;
    Timestamp begun;  // start of waiting, on the drive's clock
  };
  using PendingFrames = std::map<Timestamp, Pending>;

  static constexpr double kReplay_s = 1.0;
  static constexpr double kCorrectable_s = 1.0;
  static constexpr double kAnchorSilence_s = 0.5;
  Timestamp clock() const {
    const std::optional<VehicleOdometry>& last = odometry_.last();
    return last && !(newest_image_ && *newest_image_ > last->stamp) ? last->stamp : *newest_image_;
  }
  /// Whether frames have the stamps of this camera.
  bool isAnchor(size_t camera_index) const;
  /// The nearest frame within the tolerance that lacks this camera's image.
  typename PendingFrames::iterator frameNear(size_t camera_index, Timestamp stamp);
  typename PendingFrames::iterator beginFrame(Timestamp stamp);
  void put(size_t camera_index, Timestamp stamp, ImageType image, typename PendingFrames::iterator frame);
  /// Joins images that came before the frame's.
  void joinEarlier(typename PendingFrames::iterator frame);
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
  Duration tolerance_{0};
  PendingFrames pending_;
  std::vector<std::map<Timestamp, ImageType>> earlier_;  // per camera: images that wait for a frame
  std::map<Timestamp, std::vector<bool>> expected_;      // where announced, after last_closed_
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

}  // namespace vcharge

#include "vcharge_core/frames/frame_assembler-inl.h"  // IWYU pragma: export
