#include "check/image_check.h"

#include <algorithm>

#include <opencv2/imgproc.hpp>

#include "vcharge_features/feature_extractor.h"

namespace vcharge::internal {
namespace {

constexpr int kSmallWidth_px = 320;
constexpr int kExposureEvery = 5;
constexpr double kManyRepeated = 0.01;
constexpr double kTooManyRepeated = 0.2;
constexpr int kDark = 4, kBright = 251;
/// Fractions of saturated (dark or bright) pixels in an image.
constexpr double kManySaturated = 0.15;
constexpr double kTooManySaturated = 0.5;
/// Standard deviation of the gray levels.
constexpr double kLowContrast = 12.0;
constexpr double kTooLowContrast = 5.0;
/// Relative change of the mean from one examined image to the next.
constexpr double kExposureStep = 0.35;
/// Detection of edges that do not move in the image while the vehicle moves.
constexpr int kMinMoved = 12;
constexpr float kMinGradient = 6.0F;
constexpr float kMinStaticRatio = 0.75F;  // length of the gradients' sum relative to the sum of their lengths
constexpr float kSteady = 0.35F;          // standard deviation of their lengths relative to the mean
/// Edges of the scene may stay in place by chance, less often with more images.
constexpr double kManyStatic = 0.003, kChanceOfOneImage = 0.4;
constexpr double kTooManyStatic = 0.3;

cv::Size smallSize(cv::Size size) {
  const double scale = std::min(1.0, static_cast<double>(kSmallWidth_px) / size.width);
  return {cvRound(size.width * scale), cvRound(size.height * scale)};
}

cv::Mat shrink(const cv::Mat& pixels) {
  cv::Mat result;
  cv::resize(pixels, result, smallSize(pixels.size()), 0, 0, cv::INTER_AREA);
  return result;
}

/// A small mask that is 255 where all covered pixels of the mask are 255.
cv::Mat shrinkMask(const cv::Mat& mask) {
  cv::Mat result;
  cv::threshold(shrink(mask), result, 254, 255, cv::THRESH_BINARY);
  return result;
}

}  // namespace

ImageCheck::ImageCheck(const RigCamera& camera) : name_(camera.name), size_px_(camera.image_size_px) {
  valid_ = shrinkMask(makeFeatureMask(camera));
}

void ImageCheck::add(const cv::Mat& pixels) {
  ++num_images_;
  if (pixels.size() != size_px_) {
    ++num_wrong_size_;
    wrong_size_px_ = pixels.size();
    return;
  }
  // Sensor noise makes all images differ.
  num_repeated_ += !last_.empty() && cv::norm(pixels, last_, cv::NORM_INF) == 0.0 ? 1 : 0;
  pixels.copyTo(last_);
  if (num_images_ % kExposureEvery != 1) {
    return;
  }
  const cv::Mat small = shrink(pixels);
  cv::Scalar mean, deviation;
  cv::meanStdDev(small, mean, deviation, valid_);
  const double num_valid = std::max(1, cv::countNonZero(valid_));
  means_.push_back(mean[0]);
  contrasts_.push_back(deviation[0]);
  dark_fractions_.push_back(cv::countNonZero((small <= kDark) & valid_) / num_valid);
  bright_fractions_.push_back(cv::countNonZero((small >= kBright) & valid_) / num_valid);
}

void ImageCheck::addMoved(const cv::Mat& pixels) {
  if (pixels.size() != size_px_) {
    return;
  }
  cv::Mat small, x, y, length;
  cv::GaussianBlur(shrink(pixels), small, cv::Size(5, 5), 0);
  cv::Sobel(small, x, CV_32F, 1, 0, 3, 0.25);
  cv::Sobel(small, y, CV_32F, 0, 1, 3, 0.25);
  cv::magnitude(x, y, length);
  if (num_moved_++ == 0) {
    sum_x_ = x;
    sum_y_ = y;
    sum_length_ = length;
    sum_square_ = length.mul(length);
    return;
  }
  sum_x_ += x;
  sum_y_ += y;
  sum_length_ += length;
  sum_square_ += length.mul(length);
}

void ImageCheck::judge(CheckFindings* findings) const {
  const auto text = [](cv::Size size) {
    return std::to_string(size.width) + "x" + std::to_string(size.height);
  };
  if (num_wrong_size_ > 0) {
    findings->add(name_ + ": size", CheckGrade::kFail,
                  std::to_string(num_wrong_size_) + " of " + std::to_string(num_images_) + " images are " +
                      text(wrong_size_px_) + "; the rig says " + text(size_px_));
  }
  if (num_wrong_size_ == num_images_) {
    return;
  }
  findings->atMost(name_ + ": frozen", fractionOf(num_repeated_, num_images_), kManyRepeated,
                   kTooManyRepeated,
                   std::to_string(num_repeated_) + " of " + std::to_string(num_images_) +
                       " images are the one before to the last pixel",
                   "the camera or its cable hangs?");
  judgeExposure(findings);
  judgeMask(findings);
}

void ImageCheck::judgeExposure(CheckFindings* findings) const {
  const double mean = quantile(means_, 0.5), contrast = quantile(contrasts_, 0.5);
  const double dark = quantile(dark_fractions_, 0.5), bright = quantile(bright_fractions_, 0.5);
  double step = 0.0;
  for (size_t i = 1; i < means_.size(); ++i) {
    step = std::max(step,
                    std::abs(means_[i] - means_[i - 1]) / std::max(10.0, std::min(means_[i], means_[i - 1])));
  }
  const std::string subject = name_ + ": exposure";
  const std::string figure = "mean " + toText(mean, 0) + ", contrast " + toText(contrast, 0) +
                             " gray levels, black " + percentText(dark) + ", white " + percentText(bright) +
                             " of the image";
  if (contrast < kLowContrast) {
    findings->add(subject, contrast < kTooLowContrast ? CheckGrade::kFail : CheckGrade::kWarn,
                  figure + ": night, fog, or a covered lens?");
  } else if (std::max(dark, bright) > kManySaturated) {
    findings->add(subject, std::max(dark, bright) > kTooManySaturated ? CheckGrade::kFail : CheckGrade::kWarn,
                  figure + (dark > bright ? ": exposure too short?" : ": exposure too long?"));
  } else {
    findings->atMost(subject, step, kExposureStep, 1e9, figure,
                     "the brightness jumps by " + percentText(step) + " within " +
                         std::to_string(kExposureEvery) + " images: exposure that changes in steps?");
  }
}

void ImageCheck::judgeMask(CheckFindings* findings) const {
  if (num_moved_ < kMinMoved) {
    return;
  }
  cv::Mat sum_length_of_mean;
  cv::magnitude(sum_x_, sum_y_, sum_length_of_mean);
  const cv::Mat has_edge = sum_length_ > kMinGradient * static_cast<float>(num_moved_);
  // A horizon keeps its position and direction, but not its strength.
  const cv::Mat is_steady =
      num_moved_ * sum_square_ < (1.0F + kSteady * kSteady) * sum_length_.mul(sum_length_);
  const cv::Mat stays = (sum_length_of_mean > kMinStaticRatio * sum_length_) & has_edge & is_steady;
  // The borders of the field of view and of the mask are not edges of the scene.
  cv::Mat inside;
  cv::erode(valid_, inside, cv::Mat::ones(7, 7, CV_8U), cv::Point(-1, -1), 1, cv::BORDER_CONSTANT,
            cv::Scalar(0));
  const double in_use = fractionOf(cv::countNonZero(stays & inside), cv::countNonZero(inside));
  const std::string subject = name_ + ": mask";
  const std::string figure =
      percentText(in_use) + " of the image shows edges that stay while the vehicle moves";
  findings->atMost(subject, in_use, kManyStatic + kChanceOfOneImage / num_moved_, kTooManyStatic, figure,
                   "the vehicle itself, or dirt on the lens: a mask in rig.yaml keeps them out");
}

}  // namespace vcharge::internal
