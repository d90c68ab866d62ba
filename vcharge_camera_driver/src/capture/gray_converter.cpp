#include "vcharge_camera_driver/gray_converter.h"

#include <linux/videodev2.h>
#include <turbojpeg.h>

#include <array>
#include <cstring>
#include <new>

#include <opencv2/imgproc.hpp>

#include "vcharge_core/base/error.h"

namespace vcharge {
namespace {

struct FormatRule {
  PixelFormat format;
  uint32_t fourcc;
  const char* name;
  int bytes_per_pixel;  // 0: compressed
  int bayer_to_gray;    // OpenCV's conversion; OpenCV names a pattern after pixels 1 and 2 of its second row
};

constexpr std::array<FormatRule, 11> kRules = {{
    {PixelFormat::kGrey, V4L2_PIX_FMT_GREY, "GREY", 1, -1},
    {PixelFormat::kY10, V4L2_PIX_FMT_Y10, "Y10", 2, -1},
    {PixelFormat::kY12, V4L2_PIX_FMT_Y12, "Y12", 2, -1},
    {PixelFormat::kY16, V4L2_PIX_FMT_Y16, "Y16", 2, -1},
    {PixelFormat::kYuyv, V4L2_PIX_FMT_YUYV, "YUYV", 2, -1},
    {PixelFormat::kUyvy, V4L2_PIX_FMT_UYVY, "UYVY", 2, -1},
    {PixelFormat::kBggr8, V4L2_PIX_FMT_SBGGR8, "BGGR8", 1, cv::COLOR_BayerRG2GRAY},
    {PixelFormat::kGbrg8, V4L2_PIX_FMT_SGBRG8, "GBRG8", 1, cv::COLOR_BayerGR2GRAY},
    {PixelFormat::kGrbg8, V4L2_PIX_FMT_SGRBG8, "GRBG8", 1, cv::COLOR_BayerGB2GRAY},
    {PixelFormat::kRggb8, V4L2_PIX_FMT_SRGGB8, "RGGB8", 1, cv::COLOR_BayerBG2GRAY},
    {PixelFormat::kMjpeg, V4L2_PIX_FMT_MJPEG, "MJPEG", 0, -1},
}};

const FormatRule& ruleOf(PixelFormat format) {
  for (const FormatRule& rule : kRules) {
    if (rule.format == format) {
      return rule;
    }
  }
  throw std::logic_error("unknown pixel format");
}

// Takes one of the two bytes of every pixel.
void takeEverySecondByte(const uint8_t* row, int first, int width, uint8_t* out) {
  for (int x = 0; x < width; ++x) {
    out[x] = row[2 * x + first];
  }
}

// Takes the upper 8 of `bits` bits.
void takeUpperBits(const uint8_t* row, int bits, int width, uint8_t* out) {
  for (int x = 0; x < width; ++x) {
    const int value = (row[2 * x] | (row[2 * x + 1] << 8)) >> (bits - 8);
    out[x] = static_cast<uint8_t>(value > 255 ? 255 : value);
  }
}

}  // namespace

const std::vector<PixelFormat>& allPixelFormats() {
  static const std::vector<PixelFormat> kAll = [] {
    std::vector<PixelFormat> all;
    for (const FormatRule& rule : kRules) {
      all.push_back(rule.format);
    }
    return all;
  }();
  return kAll;
}

uint32_t fourccOf(PixelFormat format) {
  return ruleOf(format).fourcc;
}
std::string toString(PixelFormat format) {
  return ruleOf(format).name;
}

std::vector<std::string> pixelFormatNames() {
  std::vector<std::string> names;
  for (const FormatRule& rule : kRules) {
    names.emplace_back(rule.name);
  }
  return names;
}

std::string fourccText(uint32_t fourcc) {
  std::string text;
  for (int i = 0; i < 4; ++i) {
    const auto character = static_cast<char>((fourcc >> (8 * i)) & 0x7f);
    text += character >= ' ' ? character : '?';
  }
  text.erase(text.find_last_not_of(' ') + 1);
  return text;
}

size_t bytesPerRow(PixelFormat format, int width_px) {
  return static_cast<size_t>(ruleOf(format).bytes_per_pixel) * static_cast<size_t>(width_px);
}

struct GrayConverter::Jpeg {
  Jpeg() : handle(tjInitDecompress()) {
    if (handle == nullptr) {
      throw std::bad_alloc();
    }
  }
  ~Jpeg() { tjDestroy(handle); }
  Jpeg(const Jpeg&) = delete;
  Jpeg& operator=(const Jpeg&) = delete;

  std::string decode(const uint8_t* data, size_t size_bytes, cv::Mat* gray) const {
    int width = 0;
    int height = 0;
    int subsampling = 0;
    int colours = 0;
    if (tjDecompressHeader3(handle, data, size_bytes, &width, &height, &subsampling, &colours) != 0) {
      return std::string("not a JPEG: ") + tjGetErrorStr2(handle);
    }
    if (width != gray->cols || height != gray->rows) {
      return "a JPEG of " + std::to_string(width) + "x" + std::to_string(height) + " pixels where " +
             std::to_string(gray->cols) + "x" + std::to_string(gray->rows) + " were agreed";
    }
    // A warning means a damaged image, which is dropped as a whole.
    if (tjDecompress2(handle, data, size_bytes, gray->data, width, static_cast<int>(gray->step), height,
                      TJPF_GRAY, TJFLAG_STOPONWARNING) != 0) {
      return std::string("a damaged JPEG: ") + tjGetErrorStr2(handle);
    }
    return "";
  }

  tjhandle handle;
};

GrayConverter::GrayConverter() = default;
GrayConverter::~GrayConverter() = default;
GrayConverter::GrayConverter(GrayConverter&& other) noexcept = default;
GrayConverter& GrayConverter::operator=(GrayConverter&& other) noexcept = default;

std::string GrayConverter::convert(PixelFormat format, const uint8_t* data, size_t size_bytes,
                                   size_t stride_bytes, cv::Mat* gray) {
  check(gray->type() == CV_8UC1 && !gray->empty(), "GrayConverter: expected a CV_8UC1 image to write to");
  if (format == PixelFormat::kMjpeg) {
    if (jpeg_ == nullptr) {
      jpeg_ = std::make_unique<Jpeg>();
    }
    std::string problem = jpeg_->decode(data, size_bytes, gray);
    if (!problem.empty()) {
      jpeg_.reset();  // after some errors, a decoder would continue in the middle of the next image
    }
    return problem;
  }
  const FormatRule& rule = ruleOf(format);
  const size_t row_bytes = bytesPerRow(format, gray->cols);
  check(stride_bytes >= row_bytes, "GrayConverter: the stride is shorter than a row");
  const size_t needed = stride_bytes * static_cast<size_t>(gray->rows - 1) + row_bytes;
  if (size_bytes < needed) {
    return std::to_string(size_bytes) + " bytes, expected " + std::to_string(needed);
  }
  if (rule.bayer_to_gray >= 0) {
    // cvtColor() does not modify its source.
    const cv::Mat mosaic(gray->rows, gray->cols, CV_8UC1, const_cast<uint8_t*>(data), stride_bytes);
    cv::cvtColor(mosaic, *gray, rule.bayer_to_gray);
    return "";
  }
  for (int y = 0; y < gray->rows; ++y) {
    const uint8_t* row = data + static_cast<size_t>(y) * stride_bytes;
    uint8_t* out = gray->ptr<uint8_t>(y);
    switch (format) {
      case PixelFormat::kY10:
        takeUpperBits(row, 10, gray->cols, out);
        break;
      case PixelFormat::kY12:
        takeUpperBits(row, 12, gray->cols, out);
        break;
      case PixelFormat::kY16:
      case PixelFormat::kUyvy:
        takeEverySecondByte(row, 1, gray->cols, out);
        break;
      case PixelFormat::kYuyv:
        takeEverySecondByte(row, 0, gray->cols, out);
        break;
      default:
        std::memcpy(out, row, row_bytes);
    }
  }
  return "";
}

}  // namespace vcharge
