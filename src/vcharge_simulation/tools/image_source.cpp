#include "image_source.h"

#include <utility>
#include <vector>

#include <nav_msgs/Odometry.h>

#include "vcharge_core/base/error.h"
#include "vcharge_recordings/bag_reader.h"
#include "vcharge_ros/conversions.h"
#include "vcharge_ros/drive_topics.h"
#include "vcharge_ros/image_conversions.h"

namespace vcharge {

namespace {

// Positions of the same drive agree to the precision of the message.
constexpr double kSamePose_m = 1e-9;

class RenderedImages : public ImageSource {
 public:
  RenderedImages(const Renderer& renderer, const RecordedCameras& cameras, const CameraResponse& response,
                 const SimulatedDrive& drive, const std::vector<double>& scene_times_s,
                 const MotionBlurFault& blur, const LensGlare* glare)
      : renderer_(renderer),
        cameras_(cameras),
        response_(response),
        drive_(drive),
        scene_times_s_(scene_times_s),
        blur_(blur),
        glare_(glare) {}

  cv::Mat image(size_t camera, size_t frame) override {
    const Duration since_start = drive_.world_from_vehicle[frame].stamp - drive_.ground_truth.front().stamp;
    const CameraView& view = cameras_.view(camera, since_start);
    Readout readout = cameras_.readout(camera, since_start, drive_.image_motion[frame]);
    const double middle_s = readout.middle_s;
    const int renderings = blur_.actsOn(cameras_.name(camera), since_start) ? blur_.renderings : 1;
    cv::Mat light;
    for (int i = 0; i < renderings; ++i) {
      readout.middle_s = middle_s + ((i + 0.5) / renderings - 0.5) * blur_.exposure_time_s;
      const cv::Mat rendered = renderer_.renderLight(view, readout, scene_times_s_[frame]);
      light = i == 0 ? rendered : light + rendered;
    }
    if (renderings > 1) {
      light /= static_cast<double>(renderings);
    }
    if (glare_ == nullptr) {
      return response_.develop(light);
    }
    readout.middle_s = middle_s;
    glare_->apply(view, readout, &light);
    return light;
  }

 private:
  const Renderer& renderer_;
  const RecordedCameras& cameras_;
  const CameraResponse& response_;
  const SimulatedDrive& drive_;
  const std::vector<double>& scene_times_s_;
  const MotionBlurFault blur_;
  const LensGlare* glare_;
};

class RecordedImages : public ImageSource {
 public:
  RecordedImages(const std::string& path, const CameraRig& rig, const SimulatedDrive& drive,
                 IsChanged is_changed, std::unique_ptr<ImageSource> changed)
      : rig_(rig),
        drive_(drive),
        is_changed_(std::move(is_changed)),
        changed_(std::move(changed)),
        bag_(path) {
    checkPoses(path);
    for (const RigCamera& camera : rig.cameras) {
      const std::string topic = DriveTopics().imageTopic(camera.name);
      entries_.push_back(bag_.entries({topic}));
      if (entries_.back().size() < drive.world_from_vehicle.size()) {
        throw InputError(path + ": " + topic + ": expected " +
                         std::to_string(drive.world_from_vehicle.size()) + " images, got " +
                         std::to_string(entries_.back().size()));
      }
    }
  }

  cv::Mat image(size_t camera, size_t frame) override {
    if (is_changed_(camera, frame)) {
      return changed_->image(camera, frame);
    }
    const BagMessage recorded = bag_.read(entries_[camera].at(frame));
    const auto message = recorded.instantiate<sensor_msgs::Image>();
    if (toTimestamp(message->header.stamp) != drive_.world_from_vehicle[frame].stamp) {
      throw InputError(recorded.source() + ": expected the images of the same drive, image " +
                       std::to_string(frame) + " has another stamp");
    }
    const Image image = toImage(message, recorded.source());
    checkImageSize(rig_.cameras[camera], image.pixels.size(), recorded.source());
    return image.pixels.clone();  // the view refers to the message
  }

 private:
  void checkPoses(const std::string& path) {
    const std::vector<BagEntry> entries = bag_.entries({"/ground_truth"});
    bool same = entries.size() >= drive_.ground_truth.size();
    for (size_t i = 0; same && i < drive_.ground_truth.size(); ++i) {
      const auto message = bag_.read(entries[i]).instantiate<nav_msgs::Odometry>();
      const VehicleOdometry& truth = drive_.ground_truth[i];
      same = toTimestamp(message->header.stamp) == truth.stamp &&
             (fromMessage(message->pose.pose, path).translation() - truth.odom_from_vehicle.translation())
                     .norm() < kSamePose_m;
    }
    if (!same) {
      throw InputError(path + ": /ground_truth: expected the poses of the same drive with the same seed");
    }
  }

  const CameraRig& rig_;
  const SimulatedDrive& drive_;
  const IsChanged is_changed_;
  const std::unique_ptr<ImageSource> changed_;
  BagReader bag_;
  std::vector<std::vector<BagEntry>> entries_;  // per camera
};

}  // namespace

std::unique_ptr<ImageSource> renderImages(const Renderer& renderer, const RecordedCameras& cameras,
                                          const CameraResponse& response, const SimulatedDrive& drive,
                                          const std::vector<double>& scene_times_s,
                                          const MotionBlurFault& blur, const LensGlare* glare) {
  return std::make_unique<RenderedImages>(renderer, cameras, response, drive, scene_times_s, blur, glare);
}

std::unique_ptr<ImageSource> readImages(const std::string& bag, const CameraRig& rig,
                                        const SimulatedDrive& drive, IsChanged is_changed,
                                        std::unique_ptr<ImageSource> changed) {
  return std::make_unique<RecordedImages>(bag, rig, drive, std::move(is_changed), std::move(changed));
}

}  // namespace vcharge
