#include <memory>
#include <string>
#include <thread>

#include <tf2_ros/static_transform_broadcaster.h>
#include <pluginlib/class_list_macros.hpp>

#include "bag_frame_source.h"
#include "driver_report.h"
#include "message_sink.h"
#include "odometry_publisher.h"
#include "vcharge_camera_driver/driver_options.h"
#include "vcharge_core/base/error.h"
#include "vcharge_ros/camera_info.h"
#include "vcharge_ros/conversions.h"
#include "vcharge_ros/drive_topics.h"
#include "vcharge_ros/nodelet.h"
#include "vcharge_ros/nodelet_support.h"
#include "vcharge_ros/parameters.h"

namespace vcharge {

/// The car's cameras and wheels: /camera/<name>/image_raw (mono8; one stamp per trigger pulse) and
/// camera_info, /odom, odom -> base_link, the rig's cameras on /tf_static, /diagnostics. Parameters: ~rig
/// (path), ~options (DriverOptions). Cameras and bus may come and go; options and rig must be right.
class CameraDriverNodelet : public Nodelet {
 public:
  ~CameraDriverNodelet() override { shutDown(); }

 private:
  struct Output {
    std::string name, frame_id;
    ros::Publisher image, info;
    sensor_msgs::CameraInfo camera_info;
  };

  void initialize() override {
    try {
      start();
    } catch (...) {
      shutDown();  // a nodelet that is refused outlives its callback queues: nothing may use them any more
      throw;
    }
  }

  void shutDown() {
    diagnostics_.clear();
    ticks_subscriber_.shutdown();
    if (source_) {
      source_->stop();
    }
    if (can_) {
      can_->stop();
    }
    for (std::thread& thread : threads_) {
      thread.join();
    }
    threads_.clear();
    odometry_.reset();
    outputs_.clear();
  }

  void start() {
    ros::NodeHandle& node = getMTNodeHandle();
    ros::NodeHandle& private_node = getMTPrivateNodeHandle();
    rig_ = std::make_shared<const CameraRig>(
        readCameraRig(requireStringParameter(private_node, "rig", "the path of a rig.yaml")));
    readFieldsFromParameters(private_node, "options", &options_);
    const cv::Size size = checkCameras(private_node.resolveName("options"));
    options_.v4l2.capture.image_size_px = size;
    const double rate_hz = options_.v4l2.capture.frame_rate_hz;
    sink_ = std::make_unique<MessageSink>(options_.cameras.size(), TriggerGrouperOptions{rate_hz},
                                          options_.stamp_offset_s,
                                          [this](const MultiFrame& group) { publish(group); });
    makeSource(size);
    // All that may be refused is above: topics that come and go at once confuse those who listen.
    addOutputs(&node);
    if (options_.odometry_source != OdometrySourceKind::kNone) {
      odometry_ = std::make_unique<OdometryPublisher>(&node, options_.odometry, rate_hz, topics_.odometry,
                                                      rig_->vehicle_frame);
    }
    broadcastCameras();
    addDiagnostics(node, private_node);
    if (options_.odometry_source == OdometrySourceKind::kCan) {
      can_ = std::make_unique<CanReader>([this] { return openCanSocket(options_.can_interface); },
                                         options_.can, now);
      addDiagnostic(node, private_node, "can", [this] { return reportCan(can_->status()); });
      threads_.emplace_back(
          [this] { can_->run([this](const WheelTicks& ticks) { odometry_->add(ticks); }); });
    } else if (odometry_ && options_.source != FrameSourceKind::kBag) {
      ticks_subscriber_ = node.subscribe<vcharge_msgs::WheelTicks>(
          topics_.wheel_ticks, 100, [this](const vcharge_msgs::WheelTicksConstPtr& message) {
            guard_.run([&] { odometry_->add(fromMessage(*message, topics_.wheel_ticks)); });
          });
    }
    threads_.emplace_back([this] { guard_.run([this] { source_->run(sink_.get()); }); });
  }

  static Timestamp now() { return toTimestamp(ros::Time::now()); }

  /// Returns the size of the cameras' images.
  cv::Size checkCameras(const std::string& source) {
    if (options_.cameras.empty()) {
      for (const RigCamera& camera : rig_->cameras) {
        options_.cameras.push_back(camera.name);
      }
    }
    if (options_.source == FrameSourceKind::kV4l2 && options_.devices.size() != options_.cameras.size()) {
      throw InputError("parameter " + source + ": devices: expected " +
                       std::to_string(options_.cameras.size()) + ", one per camera, got " +
                       std::to_string(options_.devices.size()));
    }
    const cv::Size size = rig_->cameras.at(rig_->cameraIndex(options_.cameras.front())).image_size_px;
    for (const std::string& name : options_.cameras) {
      const RigCamera& camera = rig_->cameras[rig_->cameraIndex(name)];
      checkImageSize(camera, size, "parameter " + source + ": cameras: " + options_.cameras.front());
    }
    return size;
  }

  void addOutputs(ros::NodeHandle* node) {
    for (const std::string& name : options_.cameras) {
      const RigCamera& camera = rig_->cameras[rig_->cameraIndex(name)];
      outputs_.push_back({name, camera.frame_id,
                          node->advertise<sensor_msgs::Image>(topics_.imageTopic(name), 10),
                          node->advertise<sensor_msgs::CameraInfo>(topics_.cameraInfoTopic(name), 10),
                          makeCameraInfo(camera)});
    }
  }

  void makeSource(cv::Size size) {
    const double rate_hz = options_.v4l2.capture.frame_rate_hz;
    if (options_.source == FrameSourceKind::kV4l2) {
      source_ = std::make_unique<V4l2FrameSource>(options_.devices, options_.v4l2, now);
    } else if (options_.source == FrameSourceKind::kFolder) {
      source_ = std::make_unique<FolderFrameSource>(options_.folder, options_.cameras, size, rate_hz,
                                                    options_.loop, now);
    } else {
      source_ = std::make_unique<BagFrameSource>(options_.bag, rig_, options_.cameras, rate_hz, now,
                                                 [this](const WheelTicks& ticks) {
                                                   if (odometry_) {
                                                     odometry_->add(ticks);
                                                   }
                                                 });
    }
  }

  void broadcastCameras() {
    std::vector<geometry_msgs::TransformStamped> transforms;
    for (const RigCamera& camera : rig_->cameras) {
      if (camera.vehicle_from_camera) {
        transforms.push_back(
            toTransformStamped(*camera.vehicle_from_camera, now(), rig_->vehicle_frame, camera.frame_id));
      }
    }
    static_broadcaster_.sendTransform(transforms);
  }

  void publish(const MultiFrame& group) {
    if (odometry_) {
      odometry_->trigger(group.stamp);  // before the images: who gets them may ask for the pose
    }
    for (size_t i = 0; i < outputs_.size(); ++i) {
      if (group.images[i].pixels.empty()) {
        continue;
      }
      Output& output = outputs_[i];
      const sensor_msgs::ImagePtr message = MessageSink::messageOf(group.images[i]);
      message->header.stamp = fromTimestamp(group.stamp);
      message->header.frame_id = output.frame_id;
      const auto info = boost::make_shared<sensor_msgs::CameraInfo>(output.camera_info);
      info->header = message->header;
      output.image.publish(message);
      output.info.publish(info);
    }
  }

  void addDiagnostic(const ros::NodeHandle& node, const ros::NodeHandle& private_node,
                     const std::string& name, std::function<DriveMonitor::Report()> report) {
    diagnostics_.push_back(
        std::make_unique<NodeletDiagnostics>(node, private_node, getName() + "/" + name, std::move(report)));
  }

  void addDiagnostics(const ros::NodeHandle& node, const ros::NodeHandle& private_node) {
    for (size_t i = 0; i < outputs_.size(); ++i) {
      addDiagnostic(node, private_node, outputs_[i].name, [this, i] {
        return reportCamera(outputs_[i].name, source_->status().at(i), sink_->counts().cameras.at(i));
      });
    }
    addDiagnostic(node, private_node, "sync", [this] {
      const TriggerGrouperCounts counts = sink_->counts();
      return reportSync(counts, std::exchange(reported_, counts));
    });
    if (odometry_) {
      addDiagnostic(node, private_node, "odometry", [this] { return odometry_->report(); });
    }
  }

  DriverOptions options_;
  DriveTopics topics_;
  CallbackGuard guard_{"camera_driver"};
  std::shared_ptr<const CameraRig> rig_;
  std::vector<Output> outputs_;  // by camera
  std::unique_ptr<OdometryPublisher> odometry_;
  std::unique_ptr<MessageSink> sink_;
  std::unique_ptr<FrameSource> source_;
  std::unique_ptr<CanReader> can_;
  tf2_ros::StaticTransformBroadcaster static_broadcaster_;
  TriggerGrouperCounts reported_;
  ros::Subscriber ticks_subscriber_;
  std::vector<std::unique_ptr<NodeletDiagnostics>> diagnostics_;
  std::vector<std::thread> threads_;
};

}  // namespace vcharge

PLUGINLIB_EXPORT_CLASS(vcharge::CameraDriverNodelet, nodelet::Nodelet)
