#include "vcharge_camera_driver/v4l2_device.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>
#include <poll.h>

#include <optional>

#include "capture/emulated_cameras.h"
#include "vcharge_camera_driver/clock_map.h"
#include "vcharge_core/base/error.h"

namespace vcharge {
namespace {

using ::testing::AllOf;
using ::testing::HasSubstr;
using ::testing::StartsWith;

constexpr int kPatience_ms = 20000;
const char* const kFast = "width=320\nheight=240\nrate_hz=100\nexposure_us=1000\nreadout_us=2000\n";

V4l2Options smallImages() {
  V4l2Options options;
  options.image_size_px = {320, 240};
  options.frame_rate_hz = 100.0;
  return options;
}

// Sleeps in poll() until a frame is available.
V4l2Frame nextFrame(V4l2Device* device) {
  V4l2Frame frame;
  while (!device->dequeue(&frame)) {
    pollfd waiting{device->fileDescriptor(), POLLIN, 0};
    if (poll(&waiting, 1, kPatience_ms) != 1) {
      throw std::runtime_error("no frame comes");
    }
  }
  return frame;
}

std::string errorOf(const std::string& path, const V4l2Options& options) {
  try {
    V4l2Device device(path, options);
  } catch (const InputError& error) {
    return error.what();
  }
  return "no error";
}

class V4l2DeviceTest : public ::testing::TestWithParam<BufferMemory> {
 protected:
  EmulatedCameras cameras_;
};

TEST_P(V4l2DeviceTest, StreamsFramesInOrderWithTheKernelsStamps) {
  const std::string path = cameras_.plug(0, std::string(kFast) + "formats=GREY\n");
  V4l2Options options = smallImages();
  options.memory = GetParam();
  V4l2Device device(path, options);
  EXPECT_EQ(device.pixelFormat(), PixelFormat::kGrey);
  GrayConverter converter;
  cv::Mat gray(device.size(), CV_8UC1);
  std::optional<V4l2Frame> last;
  for (int i = 0; i < 30; ++i) {
    const V4l2Frame frame = nextFrame(&device);
    ASSERT_EQ(
        converter.convert(device.pixelFormat(), frame.data, frame.size_bytes, device.strideBytes(), &gray),
        "");
    device.enqueue(frame);
    const auto pulse = static_cast<int64_t>(pulseIn(gray));
    EXPECT_EQ(frame.monotonic_stamp.nanoseconds(), pulse * 10000000 + 1000000);
    EXPECT_LT(frame.monotonic_stamp, monotonicNow());
    EXPECT_TRUE(frame.has_kernel_stamp);
    EXPECT_EQ(gray.at<uint8_t>(100, 200), 200) << "the ramp below the pulse's number";
    if (last) {
      // A loaded machine may lose frames; number and stamp count them equally.
      const auto pulses = (frame.monotonic_stamp - last->monotonic_stamp).count() / 10000000;
      EXPECT_GE(pulses, 1);
      EXPECT_EQ(frame.sequence - last->sequence, pulses);
    }
    last = frame;
  }
}

INSTANTIATE_TEST_SUITE_P(Memory, V4l2DeviceTest,
                         ::testing::Values(BufferMemory::kMmap, BufferMemory::kUserPointer));

TEST_F(V4l2DeviceTest, DeliversThePulsesNumberInEveryFormatThatKeepsIt) {
  for (const std::string name : {"GREY", "Y10 ", "Y12 ", "Y16 ", "YUYV", "UYVY"}) {
    const std::string path = cameras_.plug(0, std::string(kFast) + "formats=RGB3," + name + "\n");
    V4l2Device device(path, smallImages());
    const V4l2Frame frame = nextFrame(&device);
    cv::Mat gray(device.size(), CV_8UC1);
    ASSERT_EQ(GrayConverter().convert(device.pixelFormat(), frame.data, frame.size_bytes,
                                      device.strideBytes(), &gray),
              "");
    EXPECT_EQ(static_cast<int64_t>(pulseIn(gray)), frame.monotonic_stamp.nanoseconds() / 10000000) << name;
  }
}

TEST_F(V4l2DeviceTest, TakesTheFirstFormatAskedForThatTheCameraHas) {
  const std::string path = cameras_.plug(0, std::string(kFast) + "formats=GREY,YUYV,MJPG\n");
  V4l2Options options = smallImages();
  options.pixel_formats = {"Y10", "MJPEG", "YUYV"};
  V4l2Device device(path, options);
  EXPECT_EQ(device.pixelFormat(), PixelFormat::kMjpeg);
  const V4l2Frame frame = nextFrame(&device);
  cv::Mat gray(device.size(), CV_8UC1);
  ASSERT_EQ(GrayConverter().convert(PixelFormat::kMjpeg, frame.data, frame.size_bytes, 0, &gray), "");
  EXPECT_NEAR(gray.at<uint8_t>(100, 160), 127, 4);
}

TEST_F(V4l2DeviceTest, NamesWhatTheCameraHasWhereThereIsNoAgreement) {
  const std::string path = cameras_.plug(0, std::string(kFast) + "formats=RGB3,YUYV\n");
  V4l2Options options = smallImages();
  options.pixel_formats = {"GREY"};
  EXPECT_THAT(errorOf(path, options), AllOf(StartsWith(path), HasSubstr("320x240"), HasSubstr("RGB3, YUYV")));
  options = smallImages();
  options.image_size_px.width = 640;
  EXPECT_THAT(errorOf(path, options),
              AllOf(StartsWith(path), HasSubstr("640x240"), HasSubstr("YUYV 320x240")));
}

TEST_F(V4l2DeviceTest, SaysWhyADeviceIsNoCamera) {
  EXPECT_THAT(errorOf(cameras_.path(7), smallImages()),
              AllOf(StartsWith(cameras_.path(7)), HasSubstr("No such file")));
  EXPECT_THAT(errorOf("/dev/null", smallImages()), HasSubstr("is not a V4L2 device: Inappropriate ioctl"));
  EXPECT_THAT(errorOf(cameras_.plug(0, "capabilities=output\n"), smallImages()), HasSubstr("is no"));
  EXPECT_THAT(errorOf(cameras_.plug(1, "capabilities=no_streaming\n"), smallImages()),
              HasSubstr("cannot stream"));
}

TEST_F(V4l2DeviceTest, PassesOnTheReasonOfEveryCallThatFails) {
  int number = 0;
  for (const std::string call : {"QUERYCAP", "S_FMT", "REQBUFS", "QUERYBUF", "QBUF", "STREAMON"}) {
    const std::string path =
        cameras_.plug(number++, std::string(kFast) + "fail=" + call + ":" + std::to_string(EBUSY) + "\n");
    EXPECT_THAT(errorOf(path, smallImages()), AllOf(StartsWith(path), HasSubstr("Device or resource busy")))
        << call;
  }
  const std::string path =
      cameras_.plug(number, std::string(kFast) + "fail=DQBUF:" + std::to_string(EIO) + "\n");
  V4l2Device device(path, smallImages());
  V4l2Frame frame;
  EXPECT_THAT([&] { device.dequeue(&frame); },
              ::testing::ThrowsMessage<InputError>(AllOf(StartsWith(path), HasSubstr("Input/output error"))));
}

TEST_F(V4l2DeviceTest, SetsControlsByTheirNames) {
  const std::string path = cameras_.plug(0, kFast);
  V4l2Options options = smallImages();
  options.controls = {"gain=17", "exposure_time_absolute=50"};
  V4l2Device device(path, options);
  EXPECT_EQ(device.control("gain"), 17);
  EXPECT_EQ(device.control("exposure_time_absolute"), 50);
  EXPECT_NEAR(device.exposure_s().value_or(0.0), 0.005, 1e-9);
  EXPECT_EQ(device.controls().size(), 3u);
  EXPECT_THAT([&] { device.setControl("gain", 256); },
              ::testing::ThrowsMessage<InputError>(AllOf(HasSubstr("gain"), HasSubstr("[0, 255]"))));
  EXPECT_THAT(
      [&] { device.setControl("shutter", 1); },
      ::testing::ThrowsMessage<InputError>(AllOf(HasSubstr("'shutter'"), HasSubstr("auto_exposure"))));
}

TEST_F(V4l2DeviceTest, ReportsDamagedFramesAndUnknownClocks) {
  const std::string path = cameras_.plug(0, std::string(kFast) + "damage_every=2\nunknown_clock=1\n");
  V4l2Device device(path, smallImages());
  int num_damaged = 0;
  for (int i = 0; i < 10; ++i) {
    const V4l2Frame frame = nextFrame(&device);
    num_damaged += frame.is_damaged ? 1 : 0;
    EXPECT_EQ(frame.is_damaged, frame.sequence % 2 == 1);
    EXPECT_FALSE(frame.has_kernel_stamp);
    EXPECT_LE(frame.monotonic_stamp, monotonicNow());
    device.enqueue(frame);
  }
  EXPECT_GT(num_damaged, 0);
}

TEST_F(V4l2DeviceTest, AnUnpluggedCameraEndsTheWaitAndIsNamed) {
  const std::string path = cameras_.plug(0, kFast);
  V4l2Device device(path, smallImages());
  nextFrame(&device);
  cameras_.unplug(0);
  EXPECT_THAT(
      [&] {
        while (true) {
          device.enqueue(nextFrame(&device));
        }
      },
      ::testing::ThrowsMessage<InputError>(AllOf(StartsWith(path), HasSubstr("No such device"))));
}

TEST_F(V4l2DeviceTest, IsDescribedWithFormatsAndControls) {
  const std::string path = cameras_.plug(0, std::string(kFast) + "formats=GREY,RGB3\n");
  const V4l2Description description = describeV4l2Device(path);
  EXPECT_TRUE(description.captures);
  EXPECT_EQ(description.card, "Emulated camera");
  EXPECT_THAT(description.formats,
              ::testing::ElementsAre("GREY 320x240 (100 Hz)", "RGB3 320x240 (100 Hz) *"));
  ASSERT_EQ(description.controls.size(), 3u);
  EXPECT_EQ(description.controls[0].name, "gain");
  EXPECT_THROW(describeV4l2Device("/dev/null"), InputError);
}

TEST(V4l2OptionsTest, RejectsBadOptionsByName) {
  const auto errorFrom = [](const std::string& yaml) -> std::string {
    V4l2Options options;
    try {
      readFields(YAML::Load(yaml), "x.yaml", &options);
    } catch (const InputError& error) {
      return error.what();
    }
    return "no error";
  };
  EXPECT_THAT(errorFrom("{frame_rate_hz: .nan}"), HasSubstr("frame_rate_hz: "));
  EXPECT_THAT(errorFrom("{pixel_formats: [GRAY]}"), HasSubstr("'GRAY'"));
  EXPECT_THAT(errorFrom("{controls: [gain]}"), HasSubstr("'gain'"));
  EXPECT_THAT(errorFrom("{controls: ['gain=1x']}"), HasSubstr("'gain=1x'"));
  EXPECT_THAT(errorFrom("{memory: dma}"), HasSubstr("mmap, userptr"));
  EXPECT_EQ(errorFrom("{memory: userptr, controls: ['gain=-1']}"), "no error");
}

}  // namespace
}  // namespace vcharge
