#include <memory>
#include <string>
#include <thread>
#include <vector>

#include <tf2_ros/static_transform_broadcaster.h>
#include <vcharge_msgs/WheelTicks.h>
#include <pluginlib/class_list_macros.hpp>

#include "driver_report.h"
#include "frame_source_factory.h"
#include "image_publisher.h"
#include "message_sink.h"
#include "odometry_publisher.h"
#include "vcharge_ros/conversions.h"
#include "vcharge_ros/nodelet.h"

namespace vcharge {

/// Publishes cameras and wheels of a car: /camera/<name>/{image_raw,camera_info} (mono8; a stamp per pulse of
/// a common trigger, else per image), /odom, odom -> base_link, cameras on /tf_static, /diagnostics.
/// Parameters: ~rig (path), ~options (DriverOptions). Cameras and bus may come and go; options and rig must
/// be valid.
class CameraDriverNodelet : public Nodelet {
 public:
  CameraDriverNodelet() : Nodelet("camera_driver", Threads::kSeveral) {}
  ~CameraDriverNodelet() override {
    end();
    for (std::thread& thread : threads_) {
      source_->stop();
      if (can_) {
        can_->stop();
      }
      thread.join();
    }
  }

 private:
  void start() override {
    rig_ = readRig();
    DriverOptions options;
    readOptions("options", &options);
    options_ = completeOptions(options, *rig_, privateNode().resolveName("options"));
    const double rate_hz = options_.v4l2.capture.frame_rate_hz;
    sink_ = std::make_unique<MessageSink>(options_.cameras.size(), TriggerGrouperOptions{rate_hz},
                                          rig_->stamp_tolerance_s == 0.0, options_.stamp_offset_s,
                                          [this](const MultiFrame& group) { publish(group); });
    source_ = makeFrameSource(options_, rig_, now, [this](const WheelTicks& ticks) { addWheels(ticks); });
    // All checks that may throw come before this: topics that appear and vanish at once confuse subscribers.
    images_ = std::make_unique<ImagePublisher>(&node(), *rig_, options_.cameras, topics_);
    if (options_.odometry_source != OdometrySourceKind::kNone) {
      odometry_ = std::make_unique<OdometryPublisher>(&node(), options_.odometry, rate_hz, topics_.odometry,
                                                      rig_->vehicle_frame);
    }
    static_broadcaster_.sendTransform(cameraTransforms(*rig_, now()));
    addStatuses();
    if (options_.odometry_source == OdometrySourceKind::kCan) {
      can_ = std::make_unique<CanReader>([this] { return openCanSocket(options_.can_interface); },
                                         options_.can, now);
      addDiagnostics(
          "/can", [this] { return reportCan(can_->status()); }, Threads::kSeveral);
      threads_.emplace_back([this] { can_->run([this](const auto& wheels) { addWheels(wheels); }); });
    } else if (odometry_ && options_.source != FrameSourceKind::kBag) {
      subscribe<vcharge_msgs::WheelTicks>(topics_.wheel_ticks, 100, [this](const auto& message) {
        addWheels(fromMessage(*message, topics_.wheel_ticks));
      });
    }
    threads_.emplace_back([this] { guard().run([this] { source_->run(sink_.get()); }); });
  }

  static Timestamp now() { return toTimestamp(ros::Time::now()); }

  void addWheels(const WheelMeasurement& wheels) {
    if (odometry_) {
      odometry_->add(wheels);
    }
  }

  void publish(const MultiFrame& group) {
    if (odometry_) {
      odometry_->trigger(group.stamp);  // before the images: their receivers may look up the pose
    }
    images_->publish(group);
  }

  void addStatuses() {
    for (size_t i = 0; i < options_.cameras.size(); ++i) {
      const auto report = [this, i] {
        return reportCamera(options_.cameras[i], source_->status().at(i), sink_->countsOf(i));
      };
      addDiagnostics("/" + options_.cameras[i], report, Threads::kSeveral);
    }
    if (rig_->stamp_tolerance_s == 0.0) {
      const auto report = [this, before = TriggerGrouperCounts()]() mutable {
        return reportSync(sink_->counts(), &before);
      };
      addDiagnostics("/sync", report, Threads::kSeveral);
    }
    if (odometry_) {
      addDiagnostics(
          "/odometry", [this] { return odometry_->report(); }, Threads::kSeveral);
    }
  }

  DriverOptions options_;
  DriveTopics topics_;
  std::shared_ptr<const CameraRig> rig_;
  std::unique_ptr<ImagePublisher> images_;
  std::unique_ptr<OdometryPublisher> odometry_;
  std::unique_ptr<MessageSink> sink_;
  std::unique_ptr<FrameSource> source_;
  std::unique_ptr<CanReader> can_;
  tf2_ros::StaticTransformBroadcaster static_broadcaster_;
  std::vector<std::thread> threads_;
};

}  // namespace vcharge

PLUGINLIB_EXPORT_CLASS(vcharge::CameraDriverNodelet, nodelet::Nodelet)
