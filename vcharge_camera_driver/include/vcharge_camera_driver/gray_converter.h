#pragma once

#include <cstddef>
#include <cstdint>
#include <memory>
#include <string>
#include <vector>

#include <opencv2/core.hpp>

namespace vcharge {

/// Pixel formats of cameras, with the names of the V4L2 documentation.
enum class PixelFormat {
  kGrey,   ///< 8 bit
  kY10,    ///< 10 bits in the lower part of 16, little endian
  kY12,    ///< 12 bits in the lower part of 16, little endian
  kY16,    ///< 16 bit little endian
  kYuyv,   ///< 4:2:2, luminance first
  kUyvy,   ///< 4:2:2, luminance second
  kBggr8,  ///< Bayer patterns, named after their first two rows
  kGbrg8,
  kGrbg8,
  kRggb8,
  kMjpeg,
};

/// All formats, fastest conversion first; this is the order of preference if the options name none.
const std::vector<PixelFormat>& allPixelFormats();
/// The four character code of V4L2.
uint32_t fourccOf(PixelFormat format);
/// Name of a format: "GREY", "Y10", "YUYV"...
std::string toString(PixelFormat format);
/// All names, in the order of allPixelFormats().
std::vector<std::string> pixelFormatNames();
/// The characters of a V4L2 code without trailing blanks.
std::string fourccText(uint32_t fourcc);
/// Bytes of one row without padding; 0 for kMjpeg.
size_t bytesPerRow(PixelFormat format, int width_px);

/// Converts camera frames to 8-bit gray directly into the caller's memory. Not thread safe; use one per
/// camera.
class GrayConverter {
 public:
  GrayConverter();
  ~GrayConverter();
  GrayConverter(GrayConverter&& other) noexcept;
  GrayConverter& operator=(GrayConverter&& other) noexcept;

  /// `data` holds `size_bytes` bytes in rows `stride_bytes` apart (ignored for kMjpeg); `gray` is CV_8UC1 of
  /// the frame's size. Returns an empty text, or the reason to reject the frame (too short, not a JPEG, a
  /// JPEG of another size, damaged); `gray` is then undefined.
  std::string convert(PixelFormat format, const uint8_t* data, size_t size_bytes, size_t stride_bytes,
                      cv::Mat* gray);

 private:
  struct Jpeg;
  std::unique_ptr<Jpeg> jpeg_;  // created for the first JPEG
};

}  // namespace vcharge
