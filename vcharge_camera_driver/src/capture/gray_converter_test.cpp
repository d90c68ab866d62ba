#include "vcharge_camera_driver/gray_converter.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>
#include <turbojpeg.h>

#include <cmath>
#include <cstdlib>
#include <random>

namespace vcharge {
namespace {

constexpr int kWidth = 48;
constexpr int kHeight = 32;

uint8_t ramp(int x, int y) {
  return static_cast<uint8_t>(3 * x + 2 * y);
}

std::vector<uint8_t> encodeJpeg(int width, int height) {
  std::vector<uint8_t> pixels;
  for (int y = 0; y < height; ++y) {
    for (int x = 0; x < width; ++x) {
      pixels.push_back(ramp(x, y));
    }
  }
  tjhandle encoder = tjInitCompress();
  unsigned char* bytes = nullptr;
  unsigned long size = 0;
  tjCompress2(encoder, pixels.data(), width, 0, height, TJPF_GRAY, &bytes, &size, TJSAMP_GRAY, 95, 0);
  std::vector<uint8_t> jpeg(bytes, bytes + size);
  tjFree(bytes);
  tjDestroy(encoder);
  return jpeg;
}

cv::Mat blank() {
  return cv::Mat(kHeight, kWidth, CV_8UC1, cv::Scalar(7));
}

TEST(GrayConverterTest, TakesTheLuminanceOfEveryFormatWithRowsThatArePadded) {
  struct Case {
    PixelFormat format;
    int low_shift;  // shift of the value in a pixel's bytes
    int offset;     // offset of the luminance byte in formats with colour
  };
  for (const Case& c :
       {Case{PixelFormat::kGrey, 0, 0}, Case{PixelFormat::kY10, 2, 0}, Case{PixelFormat::kY12, 4, 0},
        Case{PixelFormat::kY16, 8, 0}, Case{PixelFormat::kYuyv, -1, 0}, Case{PixelFormat::kUyvy, -1, 1}}) {
    const size_t stride = bytesPerRow(c.format, kWidth) + 16;
    std::vector<uint8_t> data(stride * kHeight, 0xaa);
    for (int y = 0; y < kHeight; ++y) {
      for (int x = 0; x < kWidth; ++x) {
        uint8_t* row = data.data() + stride * static_cast<size_t>(y);
        if (c.format == PixelFormat::kGrey) {
          row[x] = ramp(x, y);
        } else if (c.low_shift >= 0) {
          const int value = (ramp(x, y) << c.low_shift) + 1;  // the lowest bits are cut off
          row[2 * x] = static_cast<uint8_t>(value & 255);
          row[2 * x + 1] = static_cast<uint8_t>(value >> 8);
        } else {
          row[2 * x + c.offset] = ramp(x, y);
        }
      }
    }
    cv::Mat gray = blank();
    const uint8_t* memory = gray.data;
    ASSERT_EQ(GrayConverter().convert(c.format, data.data(), data.size(), stride, &gray), "")
        << toString(c.format);
    EXPECT_EQ(gray.data, memory) << "no copy";
    for (int y = 0; y < kHeight; ++y) {
      for (int x = 0; x < kWidth; ++x) {
        ASSERT_EQ(gray.at<uint8_t>(y, x), ramp(x, y)) << toString(c.format) << " at " << x << ", " << y;
      }
    }
  }
}

TEST(GrayConverterTest, WeighsTheColoursOfABayerPattern) {
  struct Case {
    PixelFormat format;
    const char* colours;  // colours of the first two rows
  };
  // Luminance of ITU-R BT.601.
  const auto expected = [](double r, double g, double b) { return 0.299 * r + 0.587 * g + 0.114 * b; };
  for (const Case& c : {Case{PixelFormat::kBggr8, "BGGR"}, Case{PixelFormat::kGbrg8, "GBRG"},
                        Case{PixelFormat::kGrbg8, "GRBG"}, Case{PixelFormat::kRggb8, "RGGB"}}) {
    std::vector<uint8_t> data;
    for (int y = 0; y < kHeight; ++y) {
      for (int x = 0; x < kWidth; ++x) {
        const char colour = c.colours[2 * (y % 2) + x % 2];
        data.push_back(colour == 'R' ? 200 : colour == 'G' ? 100 : 20);
      }
    }
    cv::Mat gray = blank();
    ASSERT_EQ(GrayConverter().convert(c.format, data.data(), data.size(), kWidth, &gray), "");
    for (int y = 0; y < kHeight; ++y) {
      for (int x = 0; x < kWidth; ++x) {
        ASSERT_NEAR(gray.at<uint8_t>(y, x), expected(200, 100, 20), 1.0) << toString(c.format);
      }
    }
  }
}

TEST(GrayConverterTest, DecodesJpegs) {
  const std::vector<uint8_t> jpeg = encodeJpeg(kWidth, kHeight);
  cv::Mat gray = blank();
  ASSERT_EQ(GrayConverter().convert(PixelFormat::kMjpeg, jpeg.data(), jpeg.size(), 0, &gray), "");
  for (int y = 0; y < kHeight; ++y) {
    for (int x = 0; x < kWidth; ++x) {
      ASSERT_NEAR(gray.at<uint8_t>(y, x), ramp(x, y), 4);  // quality 95
    }
  }
}

TEST(GrayConverterTest, SaysWhatIsWrongWithAFrame) {
  GrayConverter converter;
  cv::Mat gray = blank();
  const std::vector<uint8_t> data(kWidth * kHeight - 1);
  EXPECT_EQ(converter.convert(PixelFormat::kGrey, data.data(), data.size(), kWidth, &gray),
            "1535 bytes, expected 1536");
  const std::vector<uint8_t> jpeg = encodeJpeg(kWidth, kHeight);
  EXPECT_THAT(converter.convert(PixelFormat::kMjpeg, jpeg.data(), jpeg.size() - 100, 0, &gray),
              ::testing::StartsWith("a damaged JPEG: "));
  EXPECT_THAT(converter.convert(PixelFormat::kMjpeg, data.data(), data.size(), 0, &gray),
              ::testing::StartsWith("not a JPEG: "));
  EXPECT_EQ(converter.convert(PixelFormat::kMjpeg, jpeg.data(), jpeg.size(), 0, &gray), "")
      << "a good frame after bad ones";
  const std::vector<uint8_t> other = encodeJpeg(kWidth, kHeight + 1);
  EXPECT_THAT(converter.convert(PixelFormat::kMjpeg, other.data(), other.size(), 0, &gray),
              ::testing::HasSubstr("48x33 pixels where 48x32"));
}

TEST(GrayConverterTest, FuzzedJpegsNeverCrashItNorWriteBesideTheImage) {
  const std::vector<uint8_t> jpeg = encodeJpeg(kWidth, kHeight);
  std::mt19937 random(11);
  GrayConverter converter;
  int num_good = 0;
  int num_bad = 0;
  for (int i = 0; i < 10000; ++i) {
    std::vector<uint8_t> fuzzed = jpeg;
    const int num_changes = static_cast<int>(random() % 6);
    for (int k = 0; k < num_changes; ++k) {
      const size_t where = random() % fuzzed.size();
      fuzzed[where] = static_cast<uint8_t>(random());
    }
    if (random() % 4 == 0) {
      fuzzed.resize(random() % (fuzzed.size() + 1));
    }
    if (random() % 16 == 0) {
      for (uint8_t& byte : fuzzed) {
        byte = static_cast<uint8_t>(random());
      }
    }
    cv::Mat guarded(kHeight + 2, kWidth, CV_8UC1, cv::Scalar(7));
    cv::Mat gray = guarded.rowRange(1, kHeight + 1);
    const std::string problem =
        converter.convert(PixelFormat::kMjpeg, fuzzed.data(), fuzzed.size(), 0, &gray);
    ++(problem.empty() ? num_good : num_bad);
    ASSERT_EQ(cv::countNonZero(guarded.row(0) != 7) + cv::countNonZero(guarded.row(kHeight + 1) != 7), 0);
  }
  EXPECT_GT(num_good, 1000);
  EXPECT_GT(num_bad, 1000);
}

}  // namespace
}  // namespace vcharge
