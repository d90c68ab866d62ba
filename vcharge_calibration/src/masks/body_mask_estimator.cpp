#include "vcharge_calibration/masks/body_mask_estimator.h"

#include <algorithm>
#include <array>
#include <cmath>

#include <tbb/parallel_for.h>
#include <opencv2/imgproc.hpp>

#include "masks/body_cut.h"
#include "vcharge_core/base/error.h"
#include "vcharge_core/base/text_format.h"

namespace vcharge {
namespace {

using internal::SmallView;
using internal::StaticStructure;

// Distance that a turn of one radian counts as.
constexpr double kTurnArm_m = 2.0;
constexpr int kHeadingBins = 12;
constexpr int kMinSamples = 25;
constexpr double kFullTurn_rad = 2.0 * CV_PI;
// Width of the seam that shows body and scene, relative to the image width.
constexpr double kMargin = 0.005;
constexpr double kManySpots = 0.001;

FrameAssemblerOptions patientAssembler() {
  FrameAssemblerOptions options;
  options.waitForEverything();
  return options;
}

double headingOf(const RigidTransform& odom_from_vehicle) {
  const Eigen::Vector3d forward = odom_from_vehicle.rotation() * Eigen::Vector3d::UnitX();
  return std::atan2(forward.y(), forward.x());
}

size_t headingBin(double heading_rad) {
  const double turn = heading_rad / kFullTurn_rad + 0.5;
  return static_cast<size_t>(std::clamp(static_cast<int>(turn * kHeadingBins), 0, kHeadingBins - 1));
}

cv::Mat drawPicture(const SmallView& view, const StaticStructure& structure, const cv::Mat& body,
                    const cv::Mat& spots) {
  cv::Mat mean, edge, moving;
  structure.mean.convertTo(mean, CV_8U);
  cv::cvtColor(mean, mean, cv::COLOR_GRAY2BGR);
  cv::Mat red = mean.clone(), blue = mean.clone();
  red.setTo(cv::Scalar(0, 0, 255), body);
  blue.setTo(cv::Scalar(255, 128, 0), spots);
  cv::addWeighted(red, 0.25, mean, 0.75, 0.0, red);
  cv::addWeighted(blue, 0.5, red, 0.5, 0.0, mean);
  structure.edge.convertTo(edge, CV_8U, 255.0);
  structure.moving.convertTo(moving, CV_8U, 100.0 / std::max(1e-6, structure.typical_moving));
  for (cv::Mat* panel : {&edge, &moving}) {
    panel->setTo(0, view.valid == 0);
    cv::cvtColor(*panel, *panel, cv::COLOR_GRAY2BGR);
  }
  cv::Mat picture;
  cv::hconcat(std::vector<cv::Mat>{mean, edge, moving}, picture);
  return picture;
}

/// Mask at the camera's size from the body at the small size.
cv::Mat enlarge(const cv::Mat& body, cv::Size size) {
  cv::Mat grown, large, mask;
  const int margin_px = std::max(2, cvRound(kMargin * body.cols));
  cv::dilate(body, grown,
             cv::getStructuringElement(cv::MORPH_ELLIPSE, cv::Size(2 * margin_px + 1, 2 * margin_px + 1)));
  cv::resize(grown, large, size, 0, 0, cv::INTER_LINEAR);
  cv::threshold(large, mask, 127, 255, cv::THRESH_BINARY_INV);
  return mask;
}

void findMask(const RigCamera& camera, const std::vector<cv::Mat>& images, const std::vector<double>& weights,
              CameraBodyMask* found) {
  const SmallView view = internal::makeSmallView(camera);
  const double area = cv::countNonZero(view.valid);
  if (area == 0.0) {
    found->remarks.emplace_back("no pixel is inside the field of view");
    return;
  }
  const StaticStructure structure = internal::findStaticStructure(view, images, weights);
  if (structure.typical_moving <= 0.0) {
    found->remarks.emplace_back("the images show nothing that moves: a covered or frozen camera?");
    return;
  }
  const internal::BodyRegions regions = internal::cutBody(view, structure);
  found->verdict = Verdict::kPass;
  found->mask = enlarge(regions.body, camera.image_size_px);
  found->body_fraction = cv::countNonZero(regions.body) / area;
  found->spot_fraction = cv::countNonZero(regions.spots) / area;
  found->picture = drawPicture(view, structure, regions.body, regions.spots);
  if (found->body_fraction == 0.0) {
    found->remarks.emplace_back("no body is visible");
  }
  if (found->spot_fraction > kManySpots) {
    found->verdict = Verdict::kWarn;
    found->remarks.push_back(toText(100.0 * found->spot_fraction, 1) +
                             " % of the view shows static edges outside of the mask: dirt on the lens?");
  }
}

}  // namespace

BodyMaskEstimator::BodyMaskEstimator(std::shared_ptr<const CameraRig> rig, const BodyMaskOptions& options)
    : rig_(std::move(rig)),
      options_(options),
      assembler_(std::max<size_t>(1, rig_->cameras.size()), patientAssembler(),
                 [this](const ImageFrame& frame) { addFrame(frame); }) {
  options_.validate();
  if (rig_->cameras.empty()) {
    throw InputError("rig: expected a camera");
  }
  assembler_.joinStamps(rig_->stamp_tolerance_s);
}

void BodyMaskEstimator::addImage(size_t camera_index, Timestamp stamp, const Image& image) {
  assembler_.addImage(camera_index, stamp, image);
}

void BodyMaskEstimator::addOdometry(const VehicleOdometry& odometry) {
  assembler_.addOdometry(odometry);
}

void BodyMaskEstimator::addFrame(const ImageFrame& frame) {
  if (!frame.bridged_from_vehicle) {
    return;
  }
  if (last_pose_) {
    const RigidTransform motion = last_pose_->inverse() * *frame.bridged_from_vehicle;
    const double distance_m = motion.translation().norm();
    if (distance_m + kTurnArm_m * angleOfRotation(motion.rotation()) < options_.sample_distance_m) {
      return;
    }
    distance_m_ += distance_m;
  }
  last_pose_ = frame.bridged_from_vehicle;
  if (num_reached_++ % stride_ != 0) {
    return;
  }
  Sample sample{headingOf(*last_pose_), {}};
  for (size_t i = 0; i < rig_->cameras.size(); ++i) {
    sample.images.emplace_back();
    if (frame.has_image[i]) {
      checkImageSize(rig_->cameras[i], frame.images[i].pixels.size(), "image");
      sample.images.back() = internal::shrink(frame.images[i].pixels, internal::smallSize(rig_->cameras[i]));
    }
  }
  samples_.push_back(std::move(sample));
  if (samples_.size() > kMaxSamples) {
    for (size_t i = 1; 2 * i < samples_.size(); ++i) {
      samples_[i] = std::move(samples_[2 * i]);
    }
    samples_.resize((samples_.size() + 1) / 2);
    stride_ *= 2;
    num_reached_ = 1;
  }
}

std::vector<double> BodyMaskEstimator::weights() const {
  // Headings count alike, however long the car drove in them, as the own shadow stays within a heading.
  std::array<int, kHeadingBins> counts{};
  for (const Sample& sample : samples_) {
    ++counts[headingBin(sample.heading_rad)];
  }
  std::vector<double> weights;
  for (const Sample& sample : samples_) {
    weights.push_back(1.0 / std::sqrt(counts[headingBin(sample.heading_rad)]));
  }
  return weights;
}

double BodyMaskEstimator::headingRange() const {
  std::array<int, kHeadingBins> counts{};
  for (const Sample& sample : samples_) {
    ++counts[headingBin(sample.heading_rad)];
  }
  const auto used = std::count_if(counts.begin(), counts.end(), [](int count) { return count >= 2; });
  return static_cast<double>(used) * kFullTurn_rad / kHeadingBins;
}

BodyMasks BodyMaskEstimator::result() {
  assembler_.finish();
  BodyMasks masks;
  masks.distance_m = distance_m_;
  masks.heading_range_rad = headingRange();
  masks.num_samples = static_cast<int>(samples_.size());
  masks.cameras.resize(rig_->cameras.size());
  const std::vector<double> weights = this->weights();
  tbb::parallel_for(size_t{0}, rig_->cameras.size(), [&](size_t i) {
    CameraBodyMask& found = masks.cameras[i];
    found.camera = rig_->cameras[i].name;
    std::vector<cv::Mat> images;
    int num_images = 0;
    for (const Sample& sample : samples_) {
      images.push_back(sample.images[i]);
      num_images += sample.images[i].empty() ? 0 : 1;
    }
    if (distance_m_ < options_.min_distance_m || num_images < kMinSamples) {
      found.remarks.push_back("not enough motion: " + toText(distance_m_, 1) + " m with " +
                              std::to_string(num_images) + " images; expected at least " +
                              toText(options_.min_distance_m, 0) + " m with odometry and " +
                              std::to_string(kMinSamples) + " images");
      return;
    }
    findMask(rig_->cameras[i], images, weights, &found);
    if (found.verdict != Verdict::kFail && masks.heading_range_rad < options_.min_heading_range_rad) {
      found.verdict = Verdict::kWarn;
      found.remarks.emplace_back(
          "little turning: distant things and the own shadow may seem part of the body");
    }
  });
  masks.verdict = Verdict::kPass;
  for (const CameraBodyMask& camera : masks.cameras) {
    masks.verdict = std::max(masks.verdict, camera.verdict);
  }
  return masks;
}

}  // namespace vcharge
