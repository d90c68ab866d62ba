#include <algorithm>
#include <array>
#include <cstring>
#include <memory>
#include <string>
#include <vector>

#include <nav_msgs/Odometry.h>
#include <ros/serialization.h>
#include <rosbag/bag.h>
#include <sensor_msgs/CompressedImage.h>
#include <sensor_msgs/Image.h>
#include <boost/make_shared.hpp>
#include <opencv2/imgcodecs.hpp>

#include "fuzz_target.h"
#include "vcharge_camera_driver/can_wheel_decoder.h"
#include "vcharge_camera_driver/candump_file.h"
#include "vcharge_camera_driver/dbc_file.h"
#include "vcharge_camera_driver/gray_converter.h"
#include "vcharge_core/base/error.h"
#include "vcharge_core/frames/recorded_drive.h"
#include "vcharge_recordings/recorded_drive_reader.h"
#include "vcharge_ros/conversions.h"
#include "vcharge_ros/image_conversions.h"

namespace vcharge {
namespace {

constexpr int kWidth_px = 16, kHeight_px = 12;

cv::Mat smallImage() {
  cv::Mat image(kHeight_px, kWidth_px, CV_8UC1);
  cv::RNG(5).fill(image, cv::RNG::UNIFORM, 0, 256);
  return image;
}

std::string jpegBytes() {
  std::vector<uint8_t> bytes;
  cv::imencode(".jpg", smallImage(), bytes);
  return {bytes.begin(), bytes.end()};
}

template <class Message>
std::string serialized(const Message& message) {
  std::string bytes(ros::serialization::serializationLength(message), '\0');
  ros::serialization::OStream stream(reinterpret_cast<uint8_t*>(bytes.data()),
                                     static_cast<uint32_t>(bytes.size()));
  ros::serialization::serialize(stream, message);
  return bytes;
}

/// Deserializes a message like a bag or a connection does. InputError if the bytes are not such a message.
template <class Message>
boost::shared_ptr<const Message> deserialized(std::string bytes) {
  const auto message = boost::make_shared<Message>();
  ros::serialization::IStream stream(reinterpret_cast<uint8_t*>(bytes.data()),
                                     static_cast<uint32_t>(bytes.size()));
  try {
    ros::serialization::deserialize(stream, *message);
  } catch (const ros::serialization::StreamOverrunException&) {
    throw InputError("no such message");
  }
  return message;
}

constexpr size_t kImageFields = 13;

/// The input has height, width and step (32 bits each), a byte for the encoding, and the data. These are set
/// directly, since roscpp allocates any length that a serialized message claims, up to 4 GB, before it checks
/// the available bytes.
std::string imageFields() {
  std::string bytes(kImageFields, '\0');
  const std::array<uint32_t, 3> sizes = {kHeight_px, kWidth_px, kWidth_px};
  std::memcpy(bytes.data(), sizes.data(), sizeof(sizes));
  return bytes + std::string(size_t{kHeight_px} * kWidth_px, '\x42');
}

void takeImage(const std::string& bytes) {
  static const std::array<const char*, 8> kEncodings = {"mono8",  "8UC1",        "bgr8", "rgba8",
                                                        "mono16", "bayer_rggb8", "",     "32FC1"};
  if (bytes.size() < kImageFields) {
    throw InputError("too short");
  }
  std::array<uint32_t, 3> sizes{};
  std::memcpy(sizes.data(), bytes.data(), sizeof(sizes));
  const auto message = boost::make_shared<sensor_msgs::Image>();
  message->height = sizes[0];
  message->width = sizes[1];
  message->step = sizes[2];
  message->encoding = kEncodings[static_cast<uint8_t>(bytes[12]) % kEncodings.size()];
  message->data.assign(bytes.begin() + kImageFields, bytes.end());
  const Image image = toImage(message, "/camera/front/image_raw");
  cv::sum(image.pixels);
}

void takeCompressedImage(const std::string& bytes) {
  const auto message = boost::make_shared<sensor_msgs::CompressedImage>();
  message->format = "jpeg";
  message->data.assign(bytes.begin(), bytes.end());
  toImage(message, "/camera/front/image_raw/compressed");
}

/// The first byte of the input selects the format, the second adds to the stride.
void convertFrame(const std::string& bytes) {
  if (bytes.size() < 2) {
    return;
  }
  const auto* data = reinterpret_cast<const uint8_t*>(bytes.data());
  const std::vector<PixelFormat>& formats = allPixelFormats();
  const PixelFormat format = formats[data[0] % formats.size()];
  cv::Mat gray(kHeight_px, kWidth_px, CV_8UC1);
  // A separate copy, so that reading past the end of the frame is detected.
  const std::vector<uint8_t> frame(data + 2, data + bytes.size());
  GrayConverter().convert(format, frame.data(), frame.size(), bytesPerRow(format, kWidth_px) + data[1] % 5,
                          &gray);
}

std::vector<std::string> frames() {
  std::vector<std::string> seeds;
  const std::vector<PixelFormat>& formats = allPixelFormats();
  for (size_t i = 0; i < formats.size(); ++i) {
    std::string seed{static_cast<char>(i), '\0'};
    seed += formats[i] == PixelFormat::kMjpeg
                ? jpegBytes()
                : std::string(bytesPerRow(formats[i], kWidth_px) * kHeight_px, '\x55');
    seeds.push_back(seed);
  }
  return seeds;
}

/// The input has signals that cross bytes, in both byte orders, and frames of 12 bytes: id, size, data, time.
void decodeCan(const std::string& bytes) {
  CanWheelOptions options;
  options.left_ticks = {{3, 13, ByteOrder::kLittle, false, 1.0, 0.0}, 0x101, {}, {}};
  options.right_ticks = {{31, 16, ByteOrder::kBig, false, 1.0, 0.0}, 0x101, {}, {}};
  options.steering_angle_rad = {{7, 32, ByteOrder::kBig, true, 1e-4, 0.5},
                                0x7a,
                                {32, 20, ByteOrder::kLittle, true, 1e-5, 0.0},
                                {52, 2, ByteOrder::kLittle, 1}};
  options.validate();
  CanWheelDecoder decoder(options);
  int64_t now_ns = 0;
  for (size_t at = 0; at + 12 <= bytes.size(); at += 12) {
    CanFrame frame;
    const auto* data = reinterpret_cast<const uint8_t*>(bytes.data() + at);
    frame.id = data[0] % 2 == 0 ? 0x101 : 0x7a;
    frame.size = std::min<uint8_t>(data[1] % 16, 8);
    std::memcpy(frame.data.data(), data + 2, 8);
    now_ns += int64_t{data[10]} * 1000000 + data[11];
    decoder.add(frame, Timestamp::fromNanoseconds(now_ns));
  }
}

struct IgnoringConsumer : RecordedDriveConsumer {
  void addImage(size_t, Timestamp, Timestamp, const Image&) override {}
  void addOdometry(Timestamp, const VehicleOdometry&) override {}
  void addBroken(const std::string&, const std::string&) override {}
};

CameraRig oneCamera() {
  return parseCameraRig(
      "cameras:\n  front:\n    image_size_px: [16, 12]\n    model: pinhole\n"
      "    intrinsics: {fx: 8, fy: 8, cx: 8, cy: 6, k1: 0, k2: 0, p1: 0, p2: 0}\n    field_of_view_rad: "
      "1.0\n",
      "rig.yaml", "");
}

std::string bagBytes(rosbag::CompressionType compression) {
  return bytesOf("a.bag", [&](const std::string& path) {
    rosbag::Bag bag(path, rosbag::bagmode::Write);
    bag.setCompression(compression);
    for (int i = 0; i < 3; ++i) {
      VehicleOdometry odometry;
      odometry.stamp = Timestamp::fromNanoseconds(1000000000 + int64_t{80000000} * i);
      const ros::Time time = fromTimestamp(odometry.stamp);
      bag.write("/camera/front/image_raw", time, *toImageMessage(smallImage(), odometry.stamp, "front"));
      bag.write("/odom", time, toMessage(odometry, "odom", "base_link"));
    }
    bag.close();
  });
}

}  // namespace

std::vector<FuzzTarget> driveTargets() {
  return {
      {"image_message", [] { return std::vector<std::string>{imageFields()}; }, takeImage},
      {"compressed_image_message", [] { return std::vector<std::string>{jpegBytes()}; }, takeCompressedImage},
      {"odometry_message",
       [] { return std::vector<std::string>{serialized(toMessage(VehicleOdometry(), "odom", "base_link"))}; },
       [](const std::string& bytes) {
         fromMessage(*deserialized<nav_msgs::Odometry>(bytes), "/odom", "base_link");
       }},
      {"wheel_ticks_message",
       [] {
         WheelTicks ticks;
         ticks.metres_per_tick = 0.01;
         return std::vector<std::string>{serialized(toMessage(ticks, "base_link"))};
       },
       [](const std::string& bytes) {
         fromMessage(*deserialized<vcharge_msgs::WheelTicks>(bytes), "/wheel_ticks");
       }},
      fileTarget("bag", "a.bag",
                 {bagBytes(rosbag::compression::Uncompressed), bagBytes(rosbag::compression::BZ2),
                  bagBytes(rosbag::compression::LZ4)},
                 [](const std::string& path) {
                   IgnoringConsumer ignore;
                   readRecordedDrive(path, oneCamera(), DriveTopics(), &ignore, {});
                 }),
      {"camera_frame", frames, convertFrame},
      fileTarget("candump", "can.log", {"(46408.584954) can0 0B4#00000000\n(46408.6) can0 18FEF100#01\n"},
                 [](const std::string& path) { readCandump(path); }),
      fileTarget("dbc", "car.dbc",
                 {"BO_ 170 A: 8 X\n SG_ P M : 56|2@1+ (1,0) [0|3] \"\" X\n"
                  " SG_ S m1 : 7|16@0- (0.01,-67.67) [0|250] \"km/h\" X\nSG_MUL_VAL_ 170 S P 1-1;\n"},
                 [](const std::string& path) {
                   const DbcFile dbc = DbcFile::read(path);
                   for (const DbcFile::Message& message : dbc.messages()) {
                     for (const DbcFile::Signal& signal : message.signals) {
                       dbc.layoutOf(message.name + "." + signal.name);
                     }
                   }
                 }),
      {"can", [] { return std::vector<std::string>{std::string(48, '\x11')}; }, decodeCan},
  };
}

}  // namespace vcharge
