#include "features/drive_features.h"

#include <limits>
#include <optional>
#include <utility>

#include "vcharge_core/base/progress_bar.h"
#include "vcharge_core/frames/multi_frame_synchronizer.h"
#include "vcharge_recordings/bag_drive_source.h"

namespace vcharge {
namespace {

class FeatureCollector : public DriveConsumer {
 public:
  FeatureCollector(const CameraRig& rig, const FeatureExtractor& extractor, double spacing_m)
      : extractor_(extractor), spacing_m_(spacing_m), synchronizer_(rig.cameras.size()) {
    for (const RigCamera& camera : rig.cameras) {
      masks_.push_back(makeFeatureMask(camera));
    }
  }

  void addImage(size_t camera_index, Timestamp stamp, const Image& image) override {
    const auto set = synchronizer_.add(camera_index, stamp, image);
    if (!set || travelled_m_ < next_m_) {
      return;
    }
    next_m_ = travelled_m_ + spacing_m_;
    FeatureFrame frame;
    frame.stamp = set->stamp;
    frame.travelled_m = travelled_m_;
    for (size_t camera = 0; camera < masks_.size(); ++camera) {
      frame.of_cameras.push_back(extractor_.extract(set->images[camera].pixels, masks_[camera]));
    }
    frames.push_back(std::move(frame));
  }

  void addOdometry(const VehicleOdometry& odometry) override {
    const Eigen::Vector3d& position = odometry.odom_from_vehicle.translation();
    travelled_m_ += last_position_ ? (position - *last_position_).norm() : 0.0;
    last_position_ = position;
  }

  std::vector<FeatureFrame> frames;

 private:
  const FeatureExtractor& extractor_;
  const double spacing_m_;
  MultiFrameSynchronizer synchronizer_;
  std::vector<cv::Mat> masks_;
  std::optional<Eigen::Vector3d> last_position_;
  double travelled_m_ = 0.0;
  double next_m_ = -std::numeric_limits<double>::infinity();
};

}  // namespace

std::vector<FeatureFrame> readDriveFeatures(const std::string& bag, std::shared_ptr<const CameraRig> rig,
                                            const FeatureExtractor& extractor, double spacing_m) {
  FeatureCollector collector(*rig, extractor, spacing_m);
  BagDriveSource source(bag, std::move(rig));
  ProgressBar progress("features of " + bag);
  source.run(&collector, [&](double fraction) { progress.update(fraction); });
  return std::move(collector.frames);
}

}  // namespace vcharge
