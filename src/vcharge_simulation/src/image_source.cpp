#include "image_source.h"

#include <vector>

#include <nav_msgs/Odometry.h>
#include <rosbag/bag.h>
#include <rosbag/view.h>

#include "vcharge_core/error.h"
#include "vcharge_ros/conversions.h"
#include "vcharge_ros/drive_topics.h"
#include "vcharge_ros/image_conversions.h"

namespace vcharge {

namespace {

// Poses of the same drive agree to the last bits that a message holds.
constexpr double kSamePose_m = 1e-9;

class RenderedImages : public ImageSource {
 public:
  RenderedImages(const Renderer& renderer, const RecordedCameras& cameras, const CameraResponse& response,
                 const SimulatedDrive& drive, const std::vector<double>& scene_times_s,
                 const MotionBlurFault& blur)
      : renderer_(renderer),
        cameras_(cameras),
        response_(response),
        drive_(drive),
        scene_times_s_(scene_times_s),
        blur_(blur) {}

  cv::Mat image(size_t camera, size_t frame) override {
    const StampedTransform& pose = drive_.world_from_vehicle[frame];
    const Duration since_start = pose.stamp - drive_.ground_truth.front().stamp;
    const CameraView& view = cameras_.view(camera, since_start);
    if (!blur_.actsOn(cameras_.name(camera), since_start)) {
      return response_.develop(renderer_.renderLight(view, pose.world_from_vehicle, scene_times_s_[frame]));
    }
    const std::vector<RigidTransform>& exposure = drive_.exposure_poses[frame];
    cv::Mat light = cv::Mat::zeros(view.size(), CV_32FC1);
    for (const RigidTransform& world_from_vehicle : exposure) {
      light += renderer_.renderLight(view, world_from_vehicle, scene_times_s_[frame]);
    }
    return response_.develop(light / static_cast<double>(exposure.size()));
  }

 private:
  const Renderer& renderer_;
  const RecordedCameras& cameras_;
  const CameraResponse& response_;
  const SimulatedDrive& drive_;
  const std::vector<double>& scene_times_s_;
  const MotionBlurFault blur_;
};

class RecordedImages : public ImageSource {
 public:
  RecordedImages(const std::string& path, const CameraRig& rig, const SimulatedDrive& drive)
      : path_(path), rig_(rig), drive_(drive) {
    try {
      bag_.open(path, rosbag::bagmode::Read);
      checkPoses();
      std::vector<std::string> topics;
      for (const RigCamera& camera : rig.cameras) {
        topics.push_back(DriveTopics().imageTopic(camera.name));
        views_.push_back(std::make_unique<rosbag::View>(bag_, rosbag::TopicQuery(topics.back())));
        if (views_.back()->size() < drive.world_from_vehicle.size()) {
          throw InputError(path + ": " + topics.back() + ": expected " +
                           std::to_string(drive.world_from_vehicle.size()) + " images, got " +
                           std::to_string(views_.back()->size()));
        }
        next_.push_back(views_.back()->begin());
      }
    } catch (const rosbag::BagException& error) {
      throw InputError(path + ": cannot be read as a bag: " + error.what());
    }
  }

  cv::Mat image(size_t camera, size_t frame) override {
    const std::string source = path_ + ": " + next_[camera]->getTopic();
    const auto message = next_[camera]->instantiate<sensor_msgs::Image>();
    ++next_[camera];
    if (message == nullptr || toTimestamp(message->header.stamp) != drive_.world_from_vehicle[frame].stamp) {
      throw InputError(source + ": expected the images of the same drive, image " + std::to_string(frame) +
                       " has another stamp or type");
    }
    const Image image = toImage(message, source);
    checkImageSize(rig_.cameras[camera], image.pixels.size(), source);
    return image.pixels.clone();  // the view ends with its message
  }

 private:
  void checkPoses() {
    rosbag::View view(bag_, rosbag::TopicQuery("/ground_truth"));
    size_t i = 0;
    bool same = view.size() >= drive_.ground_truth.size();
    for (const rosbag::MessageInstance& item : view) {
      const auto message = item.instantiate<nav_msgs::Odometry>();
      if (!same || i == drive_.ground_truth.size()) {
        break;
      }
      const VehicleOdometry& truth = drive_.ground_truth[i++];
      same = message != nullptr && toTimestamp(message->header.stamp) == truth.stamp &&
             (fromMessage(message->pose.pose, path_).translation() - truth.odom_from_vehicle.translation())
                     .norm() < kSamePose_m;
    }
    if (!same) {
      throw InputError(path_ + ": /ground_truth: expected the poses of the same drive with the same seed");
    }
  }

  const std::string path_;
  const CameraRig& rig_;
  const SimulatedDrive& drive_;
  rosbag::Bag bag_;
  std::vector<std::unique_ptr<rosbag::View>> views_;
  std::vector<rosbag::View::iterator> next_;
};

}  // namespace

std::unique_ptr<ImageSource> renderImages(const Renderer& renderer, const RecordedCameras& cameras,
                                          const CameraResponse& response, const SimulatedDrive& drive,
                                          const std::vector<double>& scene_times_s,
                                          const MotionBlurFault& blur) {
  return std::make_unique<RenderedImages>(renderer, cameras, response, drive, scene_times_s, blur);
}

std::unique_ptr<ImageSource> readImages(const std::string& bag, const CameraRig& rig,
                                        const SimulatedDrive& drive) {
  return std::make_unique<RecordedImages>(bag, rig, drive);
}

}  // namespace vcharge
