#include "report/report_pictures.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <sstream>

#include <opencv2/imgcodecs.hpp>
#include <opencv2/imgproc.hpp>

#include "vcharge_calibration/intrinsics/image_coverage.h"
#include "vcharge_core/base/text_format.h"
#include "vcharge_reconstruction/keyframe_images.h"

namespace vcharge {

namespace {

constexpr int kMapColumns = 16;
constexpr int kMapRows = 10;
constexpr int kViewSize_px = 360;
constexpr double kViewWidth_rad = 1.7453;
constexpr int kJpegQuality = 80;

std::string svg(cv::Size size, const std::string& content) {
  const std::string box = std::to_string(size.width) + " " + std::to_string(size.height);
  return "<svg viewBox=\"0 0 " + box + "\" xmlns=\"http://www.w3.org/2000/svg\"><rect width=\"" +
         std::to_string(size.width) + "\" height=\"" + std::to_string(size.height) +
         "\" fill=\"#fff\" stroke=\"#888\"/>" + content + "</svg>";
}

// Colour scale from white through yellow to red.
std::string heatColour(double fraction) {
  const double s = std::clamp(fraction, 0.0, 1.0);
  const int green = static_cast<int>(std::lround(255.0 - 190.0 * s * s));
  const int blue = static_cast<int>(std::lround(std::max(40.0, 225.0 - 400.0 * s)));
  return "rgb(255," + std::to_string(green) + "," + std::to_string(blue) + ")";
}

std::string base64(const std::vector<uint8_t>& bytes) {
  static const char* const kLetters = "ABCDEFGHIJKLMNOPQRSTUVWXYZabcdefghijklmnopqrstuvwxyz0123456789+/";
  std::string text;
  text.reserve((bytes.size() + 2) / 3 * 4);
  for (size_t i = 0; i < bytes.size(); i += 3) {
    const size_t left = bytes.size() - i;
    const uint32_t group = static_cast<uint32_t>(bytes[i]) << 16 |
                           (left > 1 ? static_cast<uint32_t>(bytes[i + 1]) << 8 : 0U) |
                           (left > 2 ? static_cast<uint32_t>(bytes[i + 2]) : 0U);
    text += kLetters[group >> 18];
    text += kLetters[group >> 12 & 63];
    text += left > 1 ? kLetters[group >> 6 & 63] : '=';
    text += left > 2 ? kLetters[group & 63] : '=';
  }
  return text;
}

/// `scale`: ratio of the image's size to the camera's.
cv::Mat pinholeView(const cv::Mat& image, const CameraModel& model, double scale,
                    const Eigen::Matrix3d& camera_from_view, cv::Size size_px, double focal_px) {
  cv::Mat map(size_px, CV_32FC2, cv::Scalar(-1e4, -1e4));
  model.visit([&](const auto& concrete) {
    for (int y = 0; y < size_px.height; ++y) {
      for (int x = 0; x < size_px.width; ++x) {
        const Eigen::Vector3d ray(x - 0.5 * (size_px.width - 1), y - 0.5 * (size_px.height - 1), focal_px);
        Eigen::Vector2d pixel;
        if (concrete.project(camera_from_view * ray, &pixel)) {
          map.at<cv::Vec2f>(y, x) = {static_cast<float>(toSmallImage(pixel.x(), scale)),
                                     static_cast<float>(toSmallImage(pixel.y(), scale))};
        }
      }
    }
  });
  cv::Mat view;
  cv::remap(image, view, map, cv::noArray(), cv::INTER_LINEAR, cv::BORDER_CONSTANT, cv::Scalar(0));
  return view;
}

}  // namespace

std::string drawCoverage(cv::Size image_size_px, const std::vector<BoardView>& views) {
  ImageCoverage coverage(image_size_px);
  for (const BoardView& view : views) {
    coverage.add(view);
  }
  std::ostringstream out;
  const double width = static_cast<double>(image_size_px.width) / ImageCoverage::kColumns;
  const double height = static_cast<double>(image_size_px.height) / ImageCoverage::kRows;
  for (int row = 0; row < ImageCoverage::kRows; ++row) {
    for (int column = 0; column < ImageCoverage::kColumns; ++column) {
      const int count = coverage.count(column, row);
      out << "<rect x=\"" << toText(column * width, 1) << "\" y=\"" << toText(row * height, 1)
          << "\" width=\"" << toText(width, 1) << "\" height=\"" << toText(height, 1) << "\" fill=\""
          << (count == 0 ? "#f7b6b0" : "#e3f2e1") << "\" stroke=\"#bbb\"><title>" << count
          << " corners</title></rect>";
    }
  }
  const double radius = image_size_px.width / 400.0;
  for (const BoardView& view : views) {
    for (const BoardCorner& corner : view.corners) {
      out << "<circle cx=\"" << toText(corner.pixel.x(), 1) << "\" cy=\"" << toText(corner.pixel.y(), 1)
          << "\" r=\"" << toText(radius, 1) << "\" fill=\"#2c6e2f\"/>";
    }
  }
  return svg(image_size_px, out.str());
}

std::string drawErrorVectors(cv::Size image_size_px, const std::vector<CornerError>& errors, double scale) {
  std::ostringstream out;
  out << "<g stroke=\"#b3261e\" stroke-width=\"" << toText(image_size_px.width / 900.0, 1) << "\">";
  for (const CornerError& entry : errors) {
    const Eigen::Vector2d end = entry.pixel + scale * entry.error_px;
    out << "<line x1=\"" << toText(entry.pixel.x(), 1) << "\" y1=\"" << toText(entry.pixel.y(), 1)
        << "\" x2=\"" << toText(end.x(), 1) << "\" y2=\"" << toText(end.y(), 1) << "\"/>";
  }
  out << "</g>";
  return svg(image_size_px, out.str());
}

std::string drawErrorMap(cv::Size image_size_px, const std::vector<CornerError>& errors) {
  std::array<double, kMapColumns * kMapRows> sums{};
  std::array<int, kMapColumns * kMapRows> counts{};
  for (const CornerError& entry : errors) {
    const int column =
        std::clamp(static_cast<int>(entry.pixel.x() * kMapColumns / image_size_px.width), 0, kMapColumns - 1);
    const int row =
        std::clamp(static_cast<int>(entry.pixel.y() * kMapRows / image_size_px.height), 0, kMapRows - 1);
    const auto cell = static_cast<size_t>(row * kMapColumns + column);
    sums[cell] += entry.error_px.squaredNorm();
    counts[cell] += 2;
  }
  double worst_px = 1e-9;
  std::array<double, kMapColumns * kMapRows> rms_px{};
  for (size_t i = 0; i < rms_px.size(); ++i) {
    rms_px[i] = counts[i] == 0 ? 0.0 : std::sqrt(sums[i] / counts[i]);
    worst_px = std::max(worst_px, rms_px[i]);
  }
  std::ostringstream out;
  const double width = static_cast<double>(image_size_px.width) / kMapColumns;
  const double height = static_cast<double>(image_size_px.height) / kMapRows;
  for (int row = 0; row < kMapRows; ++row) {
    for (int column = 0; column < kMapColumns; ++column) {
      const auto i = static_cast<size_t>(row * kMapColumns + column);
      if (counts[i] == 0) {
        continue;
      }
      out << "<rect x=\"" << toText(column * width, 1) << "\" y=\"" << toText(row * height, 1)
          << "\" width=\"" << toText(width, 1) << "\" height=\"" << toText(height, 1) << "\" fill=\""
          << heatColour(rms_px[i] / worst_px) << "\"/><text x=\"" << toText((column + 0.5) * width, 1)
          << "\" y=\"" << toText((row + 0.6) * height, 1) << "\" font-size=\"" << toText(0.28 * width, 1)
          << "\" text-anchor=\"middle\" fill=\"#333\">" << toText(rms_px[i], 2) << "</text>";
    }
  }
  return svg(image_size_px, out.str());
}

std::string embedPicture(const cv::Mat& picture, int max_width_px) {
  cv::Mat small = picture;
  if (picture.cols > max_width_px) {
    const double scale = static_cast<double>(max_width_px) / picture.cols;
    cv::resize(picture, small, cv::Size(), scale, scale, cv::INTER_AREA);
  }
  std::vector<uint8_t> bytes;
  cv::imencode(".jpg", small, bytes, {cv::IMWRITE_JPEG_QUALITY, kJpegQuality});
  return "<img alt=\"\" src=\"data:image/jpeg;base64," + base64(bytes) + "\"/>";
}

cv::Mat drawCorners(const cv::Mat& image, const CalibrationBoard& board, const BoardView& view) {
  cv::Mat picture;
  cv::cvtColor(image, picture, cv::COLOR_GRAY2BGR);
  const int radius = std::max(3, image.cols / 200);
  for (const BoardCorner& corner : view.corners) {
    const cv::Point at(static_cast<int>(std::lround(corner.pixel.x())),
                       static_cast<int>(std::lround(corner.pixel.y())));
    const bool first = corner.index < board.columns;
    const cv::Scalar colour = corner.index == 0 ? cv::Scalar(60, 60, 255)
                              : first           ? cv::Scalar(255, 160, 40)
                                                : cv::Scalar(60, 200, 60);
    cv::circle(picture, at, radius, colour, std::max(1, radius / 3), cv::LINE_AA);
  }
  return picture;
}

cv::Mat perspectiveView(const cv::Mat& image, const RigCamera& camera,
                        const Eigen::Matrix3d& camera_from_view, cv::Size size_px, double focal_px) {
  return pinholeView(image, camera.model, static_cast<double>(image.cols) / camera.image_size_px.width,
                     camera_from_view, size_px, focal_px);
}

cv::Mat undistortedView(const cv::Mat& image, const CameraModel& model, double yaw_rad) {
  const double focal_px = 0.5 * kViewSize_px / std::tan(0.5 * kViewWidth_rad);
  return pinholeView(image, model, 1.0,
                     Eigen::AngleAxisd(yaw_rad, Eigen::Vector3d::UnitY()).toRotationMatrix(),
                     {kViewSize_px, kViewSize_px}, focal_px);
}

}  // namespace vcharge
