#include <limits>
#include <memory>
#include <mutex>
#include <string>

#include <sensor_msgs/CompressedImage.h>
#include <sensor_msgs/Image.h>
#include <std_srvs/Trigger.h>
#include <vcharge_msgs/CalibrationStatus.h>
#include <pluginlib/class_list_macros.hpp>

#include "vcharge_calibration/intrinsics/collector_picture.h"
#include "vcharge_calibration/intrinsics/view_collector.h"
#include "vcharge_calibration/report/calibration_files.h"
#include "vcharge_ros/conversions.h"
#include "vcharge_ros/drive_topics.h"
#include "vcharge_ros/image_conversions.h"
#include "vcharge_ros/nodelet.h"
#include "vcharge_ros/nodelet_support.h"
#include "vcharge_ros/parameters.h"

namespace vcharge {

/// Collects views of a board from a camera's images, says on /calibration/status and /diagnostics what is
/// still missing, shows on /calibration/image where the board was seen, and calibrates on the service
/// ~calibrate. Parameters: ~camera, ~output (rig.yaml), ~board ("9x6") and ~square_m, or ~target (Kalibr's
/// YAML); optional ~report (HTML), ~keep_others, ~field_of_view_rad, ~topic, ~compressed, ~collector
/// (ViewCollectorOptions), ~options (IntrinsicCalibrationOptions).
class IntrinsicCalibrationNodelet : public Nodelet {
 private:
  using Status = vcharge_msgs::CalibrationStatus;

  void initialize() override {
    ros::NodeHandle& node = getNodeHandle();
    ros::NodeHandle& private_node = getPrivateNodeHandle();
    output_.camera_name = requireStringParameter(private_node, "camera", "the camera's name");
    output_.rig_file = requireStringParameter(private_node, "output", "the path of the rig.yaml to write");
    output_.report_file = private_node.param<std::string>("report", "");
    output_.keep_others = private_node.param("keep_others", false);
    output_.field_of_view_rad = private_node.param("field_of_view_rad", 0.0);
    const auto target = private_node.param<std::string>("target", "");
    board_ = target.empty() ? CalibrationBoard::parse(private_node.param<std::string>("board", "9x6"),
                                                      private_node.param("square_m", 0.1))
                            : readCalibrationBoard(target);
    readFieldsFromParameters(private_node, "options", &options_);
    ViewCollectorOptions collector_options;
    readFieldsFromParameters(private_node, "collector", &collector_options);
    collector_ = std::make_unique<ViewCollector>(board_, options_.model, collector_options);

    status_.subject = "intrinsics of " + output_.camera_name;
    status_.rms_px = std::numeric_limits<double>::quiet_NaN();
    status_publisher_ = node.advertise<Status>("/calibration/status", 10, true);
    image_publisher_ = node.advertise<sensor_msgs::Image>("/calibration/image", 1);
    topic_ = private_node.param("topic", DriveTopics().imageTopic(output_.camera_name));
    // The newest image only: looking for the board takes longer than the next image.
    if (private_node.param("compressed", false)) {
      topic_ += "/compressed";
      images_ = node.subscribe<sensor_msgs::CompressedImage>(
          topic_, 1, [this](const sensor_msgs::CompressedImageConstPtr& message) { take(message); });
    } else {
      images_ = node.subscribe<sensor_msgs::Image>(
          topic_, 1, [this](const sensor_msgs::ImageConstPtr& message) { take(message); });
    }
    service_ = private_node.advertiseService(
        "calibrate", boost::function<bool(std_srvs::Trigger::Request&, std_srvs::Trigger::Response&)>(
                         [this](std_srvs::Trigger::Request& /*request*/,
                                std_srvs::Trigger::Response& response) { return calibrate(&response); }));
    publish(Status::COLLECTING, "waiting for images on " + topic_, 0.0);
    diagnostics_ = std::make_unique<NodeletDiagnostics>(getMTNodeHandle(), getMTPrivateNodeHandle(),
                                                        getName(), [this] { return report(); });
  }

  template <class Message>
  void take(const boost::shared_ptr<const Message>& message) {
    guard_.run([&] {
      const Image image = toImage(message, topic_);
      const Timestamp stamp = toTimestamp(message->header.stamp);
      const ViewCollector::Outcome outcome = collector_->add({toString(stamp), image.pixels});
      const bool enough = collector_->missing().empty();
      publish(enough ? Status::READY : Status::COLLECTING, toString(outcome),
              std::min(1.0, collector_->coveredFraction()));
      if (image_publisher_.getNumSubscribers() > 0) {
        image_publisher_.publish(
            toImageMessage(drawCollected(image.pixels, *collector_), stamp, message->header.frame_id));
      }
    });
  }

  bool calibrate(std_srvs::Trigger::Response* response) {
    const bool done = guard_.run([&] {
      const IntrinsicCalibration result =
          calibrateIntrinsics(board_, collector_->images(), options_,
                              [this](double share) { publish(Status::CALIBRATING, "calibrating", share); });
      writeCalibration(output_, board_, collector_->images(), result);
      response->success = result.verdict != Verdict::kFail ? 1 : 0;
      response->message = toString(result.verdict);
      for (const std::string& remark : result.remarks) {
        response->message += "; " + remark;
      }
      const std::lock_guard<std::mutex> lock(mutex_);
      status_.rms_px = response->success != 0 ? result.rms_px : std::numeric_limits<double>::quiet_NaN();
    });
    if (!done) {
      response->success = 0;
      response->message = guard_.lastError();
    }
    publish(response->success != 0 ? Status::DONE : Status::FAILED, response->message, 1.0);
    return true;
  }

  void publish(uint8_t state, const std::string& message, double progress) {
    const std::lock_guard<std::mutex> lock(mutex_);
    status_.header.stamp = ros::Time::now();
    status_.state = state;
    status_.message = message;
    status_.progress = progress;
    status_.missing = collector_->missing();
    status_.num_views = static_cast<uint32_t>(collector_->images().size());
    status_.covered_fraction = collector_->coveredFraction();
    status_publisher_.publish(status_);
  }

  DriveMonitor::Report report() {
    const std::lock_guard<std::mutex> lock(mutex_);
    DriveMonitor::Report report;
    const bool bad = status_.state == Status::FAILED || guard_.numFailures() > reported_failures_;
    report.level = bad                       ? DriveMonitor::Level::kError
                   : status_.missing.empty() ? DriveMonitor::Level::kOk
                                             : DriveMonitor::Level::kWarn;
    report.message = guard_.numFailures() > reported_failures_ ? guard_.lastError()
                     : status_.missing.empty()                 ? status_.message
                                                               : "missing: " + status_.missing.front();
    reported_failures_ = guard_.numFailures();
    report.values = {{"views", std::to_string(status_.num_views)},
                     {"covered_fraction", std::to_string(status_.covered_fraction)},
                     {"last image", status_.message}};
    return report;
  }

  CalibrationBoard board_;
  CalibrationOutput output_;
  IntrinsicCalibrationOptions options_;
  std::unique_ptr<ViewCollector> collector_;
  std::string topic_;
  CallbackGuard guard_{"intrinsic_calibration"};
  std::mutex mutex_;  // diagnostics come from another thread
  Status status_;
  uint64_t reported_failures_ = 0;
  ros::Publisher status_publisher_, image_publisher_;
  ros::Subscriber images_;
  ros::ServiceServer service_;
  std::unique_ptr<NodeletDiagnostics> diagnostics_;
};

}  // namespace vcharge

PLUGINLIB_EXPORT_CLASS(vcharge::IntrinsicCalibrationNodelet, nodelet::Nodelet)
