#include "vcharge_calibration/intrinsics/intrinsic_calibration.h"

#include <algorithm>
#include <cmath>
#include <limits>
#include <mutex>
#include <utility>

#include <tbb/parallel_for.h>

#include "intrinsics/calibration_verdict.h"
#include "intrinsics/image_orientation.h"
#include "intrinsics/intrinsic_optimizer.h"
#include "intrinsics/view_fit.h"
#include "vcharge_calibration/boards/board_detector.h"
#include "vcharge_calibration/intrinsics/image_coverage.h"
#include "vcharge_core/base/error.h"
#include "vcharge_core/base/options.h"
#include "vcharge_core/base/text_format.h"

namespace vcharge {

namespace {

// Fraction of the progress for detecting boards with and without a camera; the rest is the fit.
constexpr double kFindFraction = 0.5;
// Number of parts into which the views are split for cross-validation.
constexpr int kCrossValidationFolds = 10;
constexpr double kFindAgainFraction = 0.3;
// Larger errors, or views that do not fit, trigger a check for turned images.
constexpr double kSuspiciousError_px = 0.5;

class Calibration {
 public:
  Calibration(const CalibrationBoard& board, const std::vector<CalibrationImage>& images,
              const IntrinsicCalibrationOptions& options, const std::function<void(double)>& progress)
      : board_(board), images_(images), options_(options), progress_(progress), found_(images.size()) {}

  IntrinsicCalibration run() {
    result_.image_size_px = images_.empty() ? cv::Size() : images_.front().pixels.size();
    for (const CalibrationImage& image : images_) {
      if (image.pixels.size() != result_.image_size_px) {
        throw InputError(image.name + ": expected an image of " + sizeText(result_.image_size_px) +
                         " px as " + images_.front().name + ", got " + sizeText(image.pixels.size()));
      }
    }
    findBoards(nullptr, 0.0, kFindFraction);
    std::vector<BoardView> views = foundViews();
    if (views.empty()) {
      return fail(nothingFound());
    }
    const auto rough = fitFromScratch(options_.model, result_.image_size_px, board_, views);
    if (rough.has_value()) {
      findBoards(&rough->model, kFindFraction, kFindAgainFraction);
      views = foundViews();
    }
    for (size_t i = 0; i < images_.size(); ++i) {
      if (!found_[i].has_value()) {
        result_.rejected.push_back({images_[i].name, "the board was not found"});
      }
    }
    if (static_cast<int>(views.size()) < options_.min_views) {
      return fail("the board was found in " + std::to_string(views.size()) + " of " +
                  std::to_string(images_.size()) + " images, at least " + std::to_string(options_.min_views) +
                  " are needed");
    }
    if (!rough.has_value()) {
      return fail("no camera of the model " + options_.model +
                  " explains the corners: is the size of the board correct?");
    }
    const auto fit = fitViews(board_, images_, views, rough->model, options_);
    progress_(0.95);
    if (fit.has_value()) {
      fill(*fit);
    }
    if (!fit.has_value() || !fit->rejected.empty() || fit->settings.bending ||
        result_.rms_px > kSuspiciousError_px) {
      const CameraModel& camera = fit.has_value() ? fit->camera.model : rough->model;
      const auto turned = findTurnedImages(board_, worstViews(views, camera), result_.image_size_px, camera);
      if (!turned.empty()) {
        return fail(std::string("some images are ") + turned.front().how +
                    " against the others: " + listOf(turned));
      }
    }
    if (!fit.has_value()) {
      return fail("the views are inconsistent: fewer than " + std::to_string(options_.min_views) +
                  " fit one camera");
    }
    judgeCalibration(options_, &result_);
    progress_(1.0);
    return result_;
  }

 private:
  static std::string sizeText(cv::Size size) {
    return std::to_string(size.width) + "x" + std::to_string(size.height);
  }

  // Returns some of the views that fit worst; they suffice to detect turned images.
  std::vector<BoardView> worstViews(const std::vector<BoardView>& views, const CameraModel& camera) const {
    constexpr size_t kMaxViews = 24;
    std::vector<std::pair<double, size_t>> order(views.size());
    tbb::parallel_for(size_t{0}, views.size(), [&](size_t v) {
      const auto posed = fitBoard(board_, views[v], camera, {Loss::kRobust});
      order[v] = {posed.has_value() ? -rmsError(board_, views[v], *posed, camera)
                                    : -std::numeric_limits<double>::infinity(),
                  v};
    });
    std::sort(order.begin(), order.end());
    order.resize(std::min(order.size(), kMaxViews));
    std::sort(order.begin(), order.end(), [](const auto& a, const auto& b) { return a.second < b.second; });
    std::vector<BoardView> worst;
    for (const auto& entry : order) {
      worst.push_back(views[entry.second]);
    }
    return worst;
  }

  static std::string listOf(const std::vector<TurnedImage>& images) {
    constexpr size_t kMaxNames = 5;
    std::string text;
    for (size_t i = 0; i < std::min(images.size(), kMaxNames); ++i) {
      text += (i == 0 ? "" : ", ") + images[i].image;
    }
    return images.size() > kMaxNames ? text + ", ..." : text;
  }

  std::string nothingFound() const {
    const std::string text = "no image shows the " + board_.description();
    const BoardDetector detector(board_);
    for (const CalibrationImage& image : images_) {
      const std::string instead = detector.describeOther(image.pixels);
      if (!instead.empty()) {
        return text + "; " + image.name + " shows " + instead;
      }
    }
    return text;
  }

  IntrinsicCalibration fail(const std::string& reason) {
    IntrinsicCalibration failed;
    failed.image_size_px = result_.image_size_px;
    failed.rejected = result_.rejected;
    failed.remarks = {reason};
    progress_(1.0);
    return failed;
  }

  // Detects the remaining boards, on all cores.
  void findBoards(const CameraModel* model, double progress_start, double progress_fraction) {
    const BoardDetector detector(board_);
    std::mutex mutex;
    size_t done = 0;
    tbb::parallel_for(size_t{0}, images_.size(), [&](size_t i) {
      if (!found_[i].has_value()) {
        auto view = model == nullptr ? detector.detect(images_[i].pixels)
                                     : detector.detect(images_[i].pixels, *model);
        if (view.has_value()) {
          view->image = images_[i].name;
          found_[i] = std::move(view);
        }
      }
      const std::lock_guard<std::mutex> lock(mutex);
      progress_(progress_start +
                progress_fraction * static_cast<double>(++done) / static_cast<double>(images_.size()));
    });
  }

  std::vector<BoardView> foundViews() const {
    std::vector<BoardView> views;
    for (const auto& view : found_) {
      if (view.has_value()) {
        views.push_back(*view);
      }
    }
    return views;
  }

  void fill(const ViewFit& fit) {
    result_.model = fit.camera.model;
    result_.rejected.insert(result_.rejected.end(), fit.rejected.begin(), fit.rejected.end());
    double sum = 0.0;
    double sum_distance = 0.0;
    double sum_bending = 0.0;
    size_t count = 0;
    ImageCoverage coverage(result_.image_size_px);
    for (size_t v = 0; v < fit.views.size(); ++v) {
      const PosedBoard& posed = fit.camera.boards[v];
      result_.views.push_back({fit.views[v], posed, rmsError(board_, fit.views[v], posed, fit.camera.model),
                               fit.edge_widths_px[v]});
      coverage.add(fit.views[v]);
      for (const BoardCorner& corner : fit.views[v].corners) {
        const double distance = reprojectionError(board_, corner, posed, fit.camera.model).norm();
        sum += distance * distance;
        sum_distance += distance;
        ++count;
        const Eigen::Vector3d point = posed.corner(board_, corner.index);
        result_.max_angle_rad =
            std::max(result_.max_angle_rad, std::atan2(point.head<2>().norm(), point.z()));
      }
      const double along = posed.bending_m[board_.columns >= board_.rows ? 0 : 2];
      sum_bending += along * along / static_cast<double>(fit.views.size());
    }
    result_.rms_px = std::sqrt(sum / (2.0 * static_cast<double>(count)));
    result_.mean_error_px = sum_distance / static_cast<double>(count);
    result_.flat_rms_px = fit.flat_rms_px;
    result_.bent_boards = fit.settings.bending;
    result_.bending_m = std::sqrt(sum_bending);
    result_.covered_fraction = coverage.coveredFraction();
    crossValidate(fit);
  }

  // Splits the views into parts and fits without each: shows the error on excluded views, and how much
  // parameters depend on the choice of views.
  void crossValidate(const ViewFit& fit) {
    const auto views = fit.views.size();
    const auto folds = static_cast<size_t>(std::min(kCrossValidationFolds, static_cast<int>(views)));
    const auto size = fit.camera.model.parameters().size();
    std::vector<double> sums(folds, 0.0);
    std::vector<size_t> counts(folds, 0);
    std::vector<std::optional<Eigen::VectorXd>> parameters(folds);
    tbb::parallel_for(size_t{0}, folds, [&](size_t fold) {
      std::vector<BoardView> seen;
      FitSettings settings = fit.settings;
      settings.sigmas_px.clear();
      for (size_t v = 0; v < views; ++v) {
        if (v % folds != fold) {
          seen.push_back(fit.views[v]);
          settings.sigmas_px.push_back(fit.settings.sigmas_px[v]);
        }
      }
      const auto camera = fitCamera(board_, seen, fit.camera.model, settings);
      if (camera.has_value()) {
        parameters[fold] = camera->model.parameters();
      }
      for (size_t v = fold; v < views; v += folds) {
        FitSettings own = fit.settings;
        own.sigmas_px = {fit.settings.sigmas_px[v]};
        const auto posed =
            camera.has_value() ? fitBoard(board_, fit.views[v], camera->model, own) : std::nullopt;
        const double rms = posed.has_value() ? rmsError(board_, fit.views[v], *posed, camera->model)
                                             : std::numeric_limits<double>::infinity();
        sums[fold] += rms * rms * 2.0 * static_cast<double>(fit.views[v].corners.size());
        counts[fold] += 2 * fit.views[v].corners.size();
      }
    });
    double sum = 0.0;
    size_t count = 0;
    for (size_t fold = 0; fold < folds; ++fold) {
      sum += sums[fold];
      count += counts[fold];
    }
    result_.cross_validated_px = count == 0 ? 0.0 : std::sqrt(sum / static_cast<double>(count));
    result_.standard_deviations = Eigen::VectorXd::Constant(size, std::numeric_limits<double>::infinity());
    const auto covariance = intrinsicsCovariance(board_, fit.views, fit.camera, fit.settings);
    const bool all_fits =
        std::all_of(parameters.begin(), parameters.end(), [](const auto& fold) { return fold.has_value(); });
    if (!covariance.has_value() || !all_fits || folds < 2) {
      return;
    }
    const Eigen::VectorXd formal = covariance->diagonal().cwiseMax(0.0).cwiseSqrt();
    // Jackknife. Errors within a view are correlated if the model of boards or lens is not exact; the usual
    // formula assumes independent corners and would underestimate the deviations. A few parts give an
    // uncertain variance of each parameter, hence the mean over all parameters.
    Eigen::VectorXd mean = Eigen::VectorXd::Zero(size);
    for (const auto& fold : parameters) {
      mean += *fold / static_cast<double>(folds);
    }
    double ratio = 0.0;
    for (const auto& fold : parameters) {
      ratio += (*fold - mean).cwiseQuotient(formal).squaredNorm() / static_cast<double>(size) *
               static_cast<double>(folds - 1) / static_cast<double>(folds);
    }
    const double inflation = std::max(1.0, std::sqrt(ratio));
    result_.standard_deviations = inflation * formal;
    findImageSigmas(fit.camera.model, inflation * inflation * *covariance);
  }

  void findImageSigmas(const CameraModel& camera, const Eigen::MatrixXd& covariance) {
    camera.visit([&](const auto& model) {
      Eigen::Vector2d centre_px, side_px;
      Eigen::Matrix<double, 2, std::decay_t<decltype(model)>::kNumParameters> of_centre, of_side;
      model.project(Eigen::Vector3d(0.0, 0.0, 1.0), &centre_px, nullptr, &of_centre);
      model.project(Eigen::Vector3d(1.0, 0.0, 1.0), &side_px, nullptr, &of_side);
      const auto of_size = (of_side - of_centre).row(0).eval();
      result_.focal_sigma =
          std::sqrt(of_size * covariance * of_size.transpose()) / std::abs(side_px.x() - centre_px.x());
      result_.principal_point_sigma_px =
          std::sqrt((of_centre * covariance * of_centre.transpose()).diagonal().maxCoeff());
    });
  }

  const CalibrationBoard board_;
  const std::vector<CalibrationImage>& images_;
  const IntrinsicCalibrationOptions& options_;
  const std::function<void(double)>& progress_;
  std::vector<std::optional<BoardView>> found_;
  IntrinsicCalibration result_;
};

}  // namespace

std::string toString(Verdict verdict) {
  return verdict == Verdict::kPass ? "PASS" : verdict == Verdict::kWarn ? "WARN" : "FAIL";
}

IntrinsicCalibration calibrateIntrinsics(const CalibrationBoard& board,
                                         const std::vector<CalibrationImage>& images,
                                         const IntrinsicCalibrationOptions& options,
                                         const std::function<void(double)>& progress) {
  options.validate();
  return Calibration(board, images, options, progress).run();
}

}  // namespace vcharge
