#include <algorithm>
#include <limits>
#include <memory>
#include <string>

#include <sensor_msgs/CompressedImage.h>
#include <sensor_msgs/Image.h>
#include <pluginlib/class_list_macros.hpp>

#include "collection_status.h"
#include "vcharge_calibration/intrinsics/collector_picture.h"
#include "vcharge_calibration/intrinsics/view_collector.h"
#include "vcharge_calibration/report/calibration_files.h"
#include "vcharge_ros/conversions.h"
#include "vcharge_ros/drive_topics.h"
#include "vcharge_ros/image_conversions.h"
#include "vcharge_ros/nodelet.h"

namespace vcharge {

/// Collects views of a board from a camera's images, reports on /calibration/status and /diagnostics what is
/// still missing, shows on /calibration/image where the board was seen, and calibrates on the service
/// ~calibrate. Parameters: ~camera, ~output (rig.yaml), ~board ("9x6") and ~square_m, or ~target (Kalibr's
/// YAML); optional ~report (HTML), ~keep_others, ~field_of_view_rad, ~topic, ~compressed, ~collector
/// (ViewCollectorOptions), ~options (IntrinsicCalibrationOptions).
class IntrinsicCalibrationNodelet : public Nodelet {
 public:
  IntrinsicCalibrationNodelet() : Nodelet("intrinsic_calibration") {}
  ~IntrinsicCalibrationNodelet() override { end(); }

 private:
  using Status = CollectionStatus::Message;
  static constexpr double kUnknown = std::numeric_limits<double>::quiet_NaN();

  void start() override {
    output_.camera_name = requireParameter("camera", "the camera's name");
    output_.rig_file = requireParameter("output", "the path of the rig.yaml to write");
    output_.report_file = parameter<std::string>("report", "");
    output_.keep_others = parameter("keep_others", false);
    output_.field_of_view_rad = parameter("field_of_view_rad", 0.0);
    const auto target = parameter<std::string>("target", "");
    board_ = target.empty()
                 ? CalibrationBoard::parse(parameter<std::string>("board", "9x6"), parameter("square_m", 0.1))
                 : readCalibrationBoard(target);
    readOptions("options", &options_);
    ViewCollectorOptions collector_options;
    readOptions("collector", &collector_options);
    collector_ = std::make_unique<ViewCollector>(board_, options_.model, collector_options);

    status_ = std::make_unique<CollectionStatus>(&node(), "intrinsics of " + output_.camera_name);
    image_publisher_ = node().advertise<sensor_msgs::Image>("/calibration/image", 1);
    const bool is_compressed = parameter("compressed", false);
    topic_ = parameter("topic", DriveTopics().imageTopic(output_.camera_name)) +
             (is_compressed ? "/compressed" : "");
    serve("calibrate", [this](std_srvs::TriggerResponse* response) { calibrate(response); });
    addDiagnostics(
        "", [this] { return status_->report(); }, Threads::kSeveral);
    publish(Status::COLLECTING, "waiting for images on " + topic_, 0.0);
    // Only the newest image waits: finding the board takes longer than an image period.
    if (is_compressed) {
      subscribe<sensor_msgs::CompressedImage>(
          topic_, 1, [this](const sensor_msgs::CompressedImageConstPtr& message) { take(message); });
    } else {
      subscribe<sensor_msgs::Image>(topic_, 1,
                                    [this](const sensor_msgs::ImageConstPtr& message) { take(message); });
    }
  }

  template <class Message>
  void take(const boost::shared_ptr<const Message>& message) {
    const Image image = toImage(message, topic_);
    const Timestamp stamp = toTimestamp(message->header.stamp);
    const ViewCollector::Outcome outcome = collector_->add({toString(stamp), image.pixels});
    publish(collector_->missing().empty() ? Status::READY : Status::COLLECTING, toString(outcome),
            std::min(1.0, collector_->coveredFraction()));
    if (image_publisher_.getNumSubscribers() > 0) {
      image_publisher_.publish(
          toImageMessage(drawCollected(image.pixels, *collector_), stamp, message->header.frame_id));
    }
  }

  void calibrate(std_srvs::TriggerResponse* response) {
    const bool is_done = guard().run([&] {
      const IntrinsicCalibration result = calibrateIntrinsics(
          board_, collector_->images(), options_,
          [this](double fraction) { publish(Status::CALIBRATING, "calibrating", fraction); });
      writeCalibration(output_, board_, collector_->images(), result);
      response->success = result.verdict != Verdict::kFail ? 1 : 0;
      response->message = toString(result.verdict);
      for (const std::string& remark : result.remarks) {
        response->message += "; " + remark;
      }
      status_->setRms(response->success != 0 ? result.rms_px : kUnknown);
    });
    if (!is_done) {
      response->success = 0;
      response->message = guard().lastError();
    }
    publish(response->success != 0 ? Status::DONE : Status::FAILED, response->message, 1.0);
  }

  void publish(uint8_t state, const std::string& text, double progress) {
    status_->publish(state, text, progress, *collector_);
  }

  CalibrationBoard board_;
  CalibrationOutput output_;
  IntrinsicCalibrationOptions options_;
  std::unique_ptr<ViewCollector> collector_;
  std::string topic_;
  std::unique_ptr<CollectionStatus> status_;
  ros::Publisher image_publisher_;
};

}  // namespace vcharge

PLUGINLIB_EXPORT_CLASS(vcharge::IntrinsicCalibrationNodelet, nodelet::Nodelet)
