#include "vcharge_calibration/intrinsic_calibration.h"

#include <algorithm>
#include <array>
#include <atomic>
#include <cmath>
#include <cstdio>
#include <limits>
#include <mutex>

#include <tbb/parallel_for.h>

#include "corner_refinement.h"
#include "edge_width.h"
#include "intrinsic_optimizer.h"
#include "vcharge_calibration/board_detector.h"
#include "vcharge_core/error.h"
#include "vcharge_core/options.h"

namespace vcharge {

namespace {

constexpr int kCoverageColumns = 8;
constexpr int kCoverageRows = 5;
constexpr double kWarnCoverage = 0.6;
constexpr double kWarnError_px = 0.5;
constexpr double kFailError_px = 3.0;
constexpr int kMaxRounds = 6;
// Window of a corner that is looked for again, over the squares' size.
constexpr double kRepairWindow = 0.25;
// Share of the work: finding boards without and with a camera, the rest is the fit.
constexpr double kFindShare = 0.5;
constexpr double kFindAgainShare = 0.4;

double median(std::vector<double> values) {
  if (values.empty()) {
    return 0.0;
  }
  const auto middle = values.begin() + static_cast<std::ptrdiff_t>(values.size() / 2);
  std::nth_element(values.begin(), middle, values.end());
  return *middle;
}

std::string number(double value, int digits) {
  std::array<char, 32> text{};
  std::snprintf(text.data(), text.size(), "%.*f", digits, value);
  return text.data();
}

class Calibration {
 public:
  Calibration(const Chessboard& board, const std::vector<CalibrationImage>& images,
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
    findBoards(nullptr, 0.0, kFindShare);
    std::vector<BoardView> views = foundViews();
    if (views.empty()) {
      return fail("no image shows the whole board of " + std::to_string(board_.columns) + "x" +
                  std::to_string(board_.rows) + " inner corners");
    }
    const auto rough = fitFromScratch(options_.model, result_.image_size_px, board_, views);
    if (rough.has_value()) {
      findBoards(&rough->model, kFindShare, kFindAgainShare);
      views = foundViews();
    }
    if (static_cast<int>(views.size()) < options_.min_views) {
      return fail("only " + std::to_string(views.size()) + " images show the board, at least " +
                  std::to_string(options_.min_views) + " are needed");
    }
    if (!rough.has_value()) {
      return fail("no camera of the model " + options_.model +
                  " explains the corners: is the board's size right?");
    }
    for (size_t i = 0; i < images_.size(); ++i) {
      if (!found_[i].has_value()) {
        result_.rejected.push_back({images_[i].name, "the board was not found"});
      }
    }
    auto fitted = fitWithoutOutliers(rough->model, &views);
    if (!fitted.has_value() || static_cast<int>(views.size()) < options_.min_views) {
      return fail("the views contradict each other: fewer than " + std::to_string(options_.min_views) +
                  " fit one camera");
    }
    fill(*fitted, views);
    judge();
    progress_(1.0);
    return result_;
  }

 private:
  static std::string sizeText(cv::Size size) {
    return std::to_string(size.width) + "x" + std::to_string(size.height);
  }

  IntrinsicCalibration fail(const std::string& reason) {
    IntrinsicCalibration failed;
    failed.image_size_px = result_.image_size_px;
    failed.rejected = result_.rejected;
    failed.remarks = {reason};
    progress_(1.0);
    return failed;
  }

  // Boards that are not found yet, on all cores.
  void findBoards(const CameraModel* model, double progress_start, double progress_share) {
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
                progress_share * static_cast<double>(++done) / static_cast<double>(images_.size()));
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

  double rmsOf(const BoardView& view, const RigidTransform& pose, const CameraModel& model) const {
    double sum = 0.0;
    for (const BoardCorner& corner : view.corners) {
      sum += reprojectionError(board_, corner, pose, model).squaredNorm();
    }
    const double rms = std::sqrt(sum / (2.0 * static_cast<double>(view.corners.size())));
    return std::isfinite(rms) ? rms : std::numeric_limits<double>::infinity();
  }

  const cv::Mat& imageOf(const BoardView& view) const {
    for (const CalibrationImage& image : images_) {
      if (image.name == view.image) {
        return image.pixels;
      }
    }
    throw std::logic_error("calibrateIntrinsics: a view without its image");
  }

  // Alternates between the fit and leaving out views and corners that do not belong to it.
  std::optional<FittedCamera> fitWithoutOutliers(const CameraModel& rough, std::vector<BoardView>* views) {
    std::optional<FittedCamera> fitted = fitCamera(board_, *views, rough, Loss::kRobust);
    for (int round = 0; round < kMaxRounds && fitted.has_value(); ++round) {
      if (!removeOutliers(*fitted, views) || static_cast<int>(views->size()) < options_.min_views) {
        break;
      }
      fitted = fitCamera(board_, *views, fitted->model, Loss::kRobust);
    }
    return fitted.has_value() ? fitCamera(board_, *views, fitted->model, Loss::kSquared) : std::nullopt;
  }

  // Corners that were missed or went astray, looked for again where the camera predicts them.
  void repairCorners(const RigidTransform& pose, const CameraModel& model, double max_error_px,
                     BoardView* view) const {
    std::vector<BoardCorner> corners;
    for (int index = 0; index < board_.numCorners(); ++index) {
      const auto found = std::find_if(view->corners.begin(), view->corners.end(),
                                      [index](const BoardCorner& corner) { return corner.index == index; });
      if (found != view->corners.end() &&
          reprojectionError(board_, *found, pose, model).norm() < max_error_px) {
        corners.push_back(*found);
        continue;
      }
      const Eigen::Vector3d place = board_.corner(index);
      const double half_m = 0.5 * board_.square_m;
      BoardCorner corner{index, {}};
      Eigen::Vector2d right;
      Eigen::Vector2d below;
      if (!model.project(pose * place, &corner.pixel) ||
          !model.project(pose * (place + Eigen::Vector3d(half_m, 0.0, 0.0)), &right) ||
          !model.project(pose * (place + Eigen::Vector3d(0.0, half_m, 0.0)), &below)) {
        continue;
      }
      const double spacing_px = 2.0 * std::min((right - corner.pixel).norm(), (below - corner.pixel).norm());
      if (refineCorner(imageOf(*view), kRepairWindow * spacing_px, max_error_px, &corner.pixel)) {
        corners.push_back(corner);
      }
    }
    view->corners = corners;
  }

  bool removeOutliers(const FittedCamera& fitted, std::vector<BoardView>* views) {
    std::vector<double> widths_px;
    std::vector<double> corner_errors_px;
    for (size_t v = 0; v < views->size(); ++v) {
      const BoardView& view = (*views)[v];
      widths_px.push_back(edgeWidth(imageOf(view), board_, view, fitted.camera_from_board[v], fitted.model));
      for (const BoardCorner& corner : view.corners) {
        corner_errors_px.push_back(
            reprojectionError(board_, corner, fitted.camera_from_board[v], fitted.model).norm());
      }
    }
    const double usual_width_px = median(widths_px);
    const double max_corner_px = options_.max_corner_error * median(corner_errors_px);
    std::vector<BoardView> repaired = *views;
    std::vector<double> errors_px;
    for (size_t v = 0; v < views->size(); ++v) {
      repairCorners(fitted.camera_from_board[v], fitted.model, max_corner_px, &repaired[v]);
      // A view most of whose corners are off is judged by what it showed.
      if (2 * repaired[v].corners.size() < (*views)[v].corners.size()) {
        repaired[v] = (*views)[v];
      }
      errors_px.push_back(rmsOf(repaired[v], fitted.camera_from_board[v], fitted.model));
    }
    const double usual_px = median(errors_px);
    bool changed = false;
    std::vector<BoardView> kept;
    for (size_t v = 0; v < views->size(); ++v) {
      if (errors_px[v] > options_.max_view_error * usual_px) {
        const bool blurred = widths_px[v] > options_.max_edge_width * usual_width_px;
        const std::string blur = "blurred: its edges are " + number(widths_px[v], 1) +
                                 " px wide, usual are " + number(usual_width_px, 1) + " px; ";
        result_.rejected.push_back({(*views)[v].image, (blurred ? blur : std::string()) + "its error of " +
                                                           number(errors_px[v], 2) + " px RMS is " +
                                                           number(errors_px[v] / usual_px, 1) +
                                                           " times the usual one"});
        changed = true;
        continue;
      }
      changed = changed || !sameCorners(repaired[v], (*views)[v]);
      kept.push_back(repaired[v]);
    }
    *views = kept;
    return changed;
  }

  static bool sameCorners(const BoardView& a, const BoardView& b) {
    return std::equal(
        a.corners.begin(), a.corners.end(), b.corners.begin(), b.corners.end(),
        [](const BoardCorner& x, const BoardCorner& y) { return x.index == y.index && x.pixel == y.pixel; });
  }

  void fill(const FittedCamera& fitted, const std::vector<BoardView>& views) {
    result_.model = fitted.model;
    double sum = 0.0;
    double sum_distance = 0.0;
    size_t count = 0;
    std::vector<bool> covered(static_cast<size_t>(kCoverageColumns * kCoverageRows), false);
    for (size_t v = 0; v < views.size(); ++v) {
      const RigidTransform& pose = fitted.camera_from_board[v];
      result_.views.push_back({views[v], pose, rmsOf(views[v], pose, fitted.model),
                               edgeWidth(imageOf(views[v]), board_, views[v], pose, fitted.model)});
      for (const BoardCorner& corner : views[v].corners) {
        const double distance = reprojectionError(board_, corner, pose, fitted.model).norm();
        sum += distance * distance;
        sum_distance += distance;
        ++count;
        const int column =
            static_cast<int>(corner.pixel.x() * kCoverageColumns / result_.image_size_px.width);
        const int row = static_cast<int>(corner.pixel.y() * kCoverageRows / result_.image_size_px.height);
        covered[static_cast<size_t>(std::clamp(row, 0, kCoverageRows - 1) * kCoverageColumns +
                                    std::clamp(column, 0, kCoverageColumns - 1))] = true;
        const Eigen::Vector3d point = pose * board_.corner(corner.index);
        result_.max_angle_rad =
            std::max(result_.max_angle_rad, std::atan2(point.head<2>().norm(), point.z()));
      }
    }
    result_.rms_px = std::sqrt(sum / (2.0 * static_cast<double>(count)));
    result_.mean_error_px = sum_distance / static_cast<double>(count);
    result_.covered_share = static_cast<double>(std::count(covered.begin(), covered.end(), true)) /
                            static_cast<double>(covered.size());
    // The corners' noise is what is left of the errors after as many parameters were fitted.
    const double freedom =
        2.0 * static_cast<double>(count) -
        static_cast<double>(fitted.model.parameters().size() + 6 * static_cast<long>(views.size()));
    const double sigma_px = std::sqrt(sum / std::max(1.0, freedom));
    const auto covariance = intrinsicsCovariance(board_, views, fitted, sigma_px);
    result_.standard_deviations = covariance.has_value()
                                      ? Eigen::VectorXd(covariance->diagonal().cwiseMax(0.0).cwiseSqrt())
                                      : Eigen::VectorXd::Constant(fitted.model.parameters().size(),
                                                                  std::numeric_limits<double>::infinity());
    crossValidate(fitted, views);
  }

  void crossValidate(const FittedCamera& fitted, const std::vector<BoardView>& views) {
    const int folds = std::min(options_.cross_validation_folds, static_cast<int>(views.size()));
    double sum = 0.0;
    size_t count = 0;
    for (int fold = 0; fold < folds; ++fold) {
      std::vector<BoardView> seen;
      std::vector<BoardView> held_out;
      for (size_t v = 0; v < views.size(); ++v) {
        (static_cast<int>(v) % folds == fold ? held_out : seen).push_back(views[v]);
      }
      const auto fit = seen.empty() ? std::nullopt : fitCamera(board_, seen, fitted.model, Loss::kSquared);
      for (const BoardView& view : held_out) {
        const auto pose = fit.has_value() ? fitPose(board_, view, fit->model) : std::nullopt;
        const double rms = pose.has_value() ? rmsOf(view, *pose, fit->model) : kFailError_px;
        sum += rms * rms * 2.0 * static_cast<double>(view.corners.size());
        count += 2 * view.corners.size();
      }
    }
    result_.cross_validated_px = count == 0 ? 0.0 : std::sqrt(sum / static_cast<double>(count));
  }

  void judge() {
    result_.verdict = Verdict::kPass;
    const auto warn = [this](const std::string& remark) {
      result_.verdict = Verdict::kWarn;
      result_.remarks.push_back(remark);
    };
    if (result_.covered_share < kWarnCoverage) {
      warn("corners cover only " + number(100.0 * result_.covered_share, 0) +
           " % of the image: hold the board also at its sides and in its corners");
    }
    if (result_.rms_px > kWarnError_px) {
      warn("the error of " + number(result_.rms_px, 2) +
           " px RMS is large: is the board flat, its size right?");
    }
    if (result_.cross_validated_px > 1.5 * result_.rms_px) {
      warn("views that the fit did not see are off by " + number(result_.cross_validated_px, 2) +
           " px, much more than the others: more views are needed");
    }
    if (!result_.standard_deviations.allFinite()) {
      warn("the views do not determine all parameters: tilt the board, and hold it near and far");
    }
    if (result_.rms_px > kFailError_px) {
      const std::vector<std::string> remarks = result_.remarks;
      result_.verdict = Verdict::kFail;
      result_.model.reset();
      result_.remarks = {"no camera of the model " + options_.model +
                         " explains the corners: " + number(result_.rms_px, 1) + " px RMS"};
    }
  }

  const Chessboard board_;
  const std::vector<CalibrationImage>& images_;
  const IntrinsicCalibrationOptions& options_;
  const std::function<void(double)>& progress_;
  std::vector<std::optional<BoardView>> found_;
  IntrinsicCalibration result_;
};

}  // namespace

void IntrinsicCalibrationOptions::validate() const {
  CameraModel::parameterNames(model);
  requireField(min_views >= 3, "min_views", "must be at least 3", min_views);
  requireField(max_view_error > 1.0, "max_view_error", "must be above 1", max_view_error);
  requireField(max_edge_width > 1.0, "max_edge_width", "must be above 1", max_edge_width);
  requireField(max_corner_error > 1.0, "max_corner_error", "must be above 1", max_corner_error);
  requireField(cross_validation_folds >= 2, "cross_validation_folds", "must be at least 2",
               cross_validation_folds);
}

IntrinsicCalibration calibrateIntrinsics(const Chessboard& board, const std::vector<CalibrationImage>& images,
                                         const IntrinsicCalibrationOptions& options,
                                         const std::function<void(double)>& progress) {
  options.validate();
  return Calibration(board, images, options, progress).run();
}

}  // namespace vcharge
