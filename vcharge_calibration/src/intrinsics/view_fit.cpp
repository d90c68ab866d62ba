#include "intrinsics/view_fit.h"

#include <algorithm>
#include <cmath>
#include <limits>
#include <map>
#include <stdexcept>
#include <string>

#include <tbb/parallel_for.h>

#include "boards/board_refinement.h"
#include "boards/edge_width.h"
#include "vcharge_core/base/quantile.h"
#include "vcharge_core/base/text_format.h"

namespace vcharge {

namespace {

constexpr int kMaxRounds = 6;
// Whether boards bend is decided after this round, when wrong corners have been removed.
constexpr int kBendingRound = 1;
// Modelling the bending must reduce the errors by this factor more than random parameters would.
constexpr double kMinBendingSignificance = 3.0;
// Largest ratio of a corner's error to the usual one of its view.
constexpr double kMaxCornerError = 5.0;
// Largest ratios of a view's RMS error and edge width to the usual ones; views beyond are removed.
constexpr double kMaxViewError = 6.0;
constexpr double kMaxEdgeWidth = 2.0;
// Corners that move less between rounds have converged.
constexpr double kSettled_px = 0.02;

bool sameCorners(const BoardView& a, const BoardView& b) {
  return std::equal(a.corners.begin(), a.corners.end(), b.corners.begin(), b.corners.end(),
                    [](const BoardCorner& x, const BoardCorner& y) {
                      return x.index == y.index && (x.pixel - y.pixel).norm() < kSettled_px;
                    });
}

class ViewFitter {
 public:
  ViewFitter(const CalibrationBoard& board, const std::vector<CalibrationImage>& images,
             const std::vector<BoardView>& views, const IntrinsicCalibrationOptions& options)
      : board_(board), options_(options) {
    fit_.views = views;
    for (const CalibrationImage& image : images) {
      images_[image.name] = image.pixels;
    }
  }

  std::optional<ViewFit> run(const CameraModel& rough) {
    fit_.settings.loss = Loss::kRobust;
    bool fitted = refit(rough);
    for (int round = 0; round < kMaxRounds && fitted; ++round) {
      const bool changed = removeOutliers();
      if (tooFew()) {
        return std::nullopt;
      }
      fitted = refit(fit_.camera.model);
      if (fitted && round == kBendingRound) {
        fitted = judgeBending();
      } else if (!changed && round > kBendingRound) {
        break;
      }
    }
    // The final fit uses least squares, in which noisy views have less weight.
    fit_.settings.loss = Loss::kSquared;
    if (!fitted || !refit(fit_.camera.model)) {
      return std::nullopt;
    }
    weighViews();
    if (!refit(fit_.camera.model)) {
      return std::nullopt;
    }
    measureFlatFit();
    for (size_t v = 0; v < fit_.views.size(); ++v) {
      fit_.edge_widths_px.push_back(widthOf(v));
    }
    return fit_;
  }

 private:
  bool tooFew() const { return static_cast<int>(fit_.views.size()) < options_.min_views; }

  bool refit(const CameraModel& start) {
    auto camera = fitCamera(board_, fit_.views, start, fit_.settings);
    if (camera.has_value()) {
      fit_.camera = *camera;
    }
    return camera.has_value();
  }

  const cv::Mat& imageOf(size_t v) const {
    const auto found = images_.find(fit_.views[v].image);
    if (found == images_.end()) {
      throw std::logic_error("fitViews: a view without its image");
    }
    return found->second;
  }

  double widthOf(size_t v) const {
    return edgeWidth(imageOf(v), board_, fit_.views[v], fit_.camera.boards[v], fit_.camera.model);
  }

  double sumOfSquares(const FittedCamera& camera, const std::vector<BoardView>& views, size_t* count) const {
    double sum = 0.0;
    *count = 0;
    for (size_t v = 0; v < views.size(); ++v) {
      const double rms = rmsError(board_, views[v], camera.boards[v], camera.model);
      sum += rms * rms * 2.0 * static_cast<double>(views[v].corners.size());
      *count += 2 * views[v].corners.size();
    }
    return sum;
  }

  // F-test: the improvement by three more parameters per view, relative to that of as many random parameters.
  bool judgeBending() {
    size_t count = 0;
    const double flat = sumOfSquares(fit_.camera, fit_.views, &count);
    const double sigma_px = std::sqrt(flat / static_cast<double>(count));
    FitSettings bending = fit_.settings;
    bending.bending = true;
    bending.sigma_px = sigma_px;
    const auto bent = fitCamera(board_, fit_.views, fit_.camera.model, bending);
    if (!bent.has_value()) {
      return true;  // boards stay flat
    }
    const double rest = sumOfSquares(*bent, fit_.views, &count);
    const double parameters = 3.0 * static_cast<double>(fit_.views.size());
    const double freedom = static_cast<double>(count) - 3.0 * parameters;
    if (freedom > parameters && (flat - rest) / parameters > kMinBendingSignificance * rest / freedom) {
      bending.sigma_px = std::sqrt(rest / freedom);
      fit_.settings = bending;
      return refit(bent->model);
    }
    return true;
  }

  void weighViews() {
    std::vector<double> errors_px;
    for (size_t v = 0; v < fit_.views.size(); ++v) {
      errors_px.push_back(rmsError(board_, fit_.views[v], fit_.camera.boards[v], fit_.camera.model));
    }
    const double usual_px = median(errors_px);
    fit_.settings.sigmas_px.clear();
    for (const double error_px : errors_px) {
      fit_.settings.sigmas_px.push_back(std::max(1e-3, std::max(usual_px, error_px)));
    }
  }

  void measureFlatFit() {
    FitSettings flat = fit_.settings;
    flat.bending = false;
    size_t count = 0;
    const auto camera = fitCamera(board_, fit_.views, fit_.camera.model, flat);
    if (camera.has_value()) {
      fit_.flat_rms_px =
          std::sqrt(sumOfSquares(*camera, fit_.views, &count) / std::max(1.0, static_cast<double>(count)));
    }
  }

  // Detects every corner of the board again in its plane, near its previous position, or near the predicted
  // one if it was missing or an outlier.
  BoardView refineView(size_t v, double max_error_px) const {
    const BoardView& view = fit_.views[v];
    const BoardRefiner refiner(imageOf(v), board_, fit_.camera.model, fit_.camera.boards[v]);
    BoardView refined{view.image, {}};
    for (int index = 0; index < board_.numCorners(); ++index) {
      const auto predicted = refiner.predict(index);
      if (!predicted.has_value()) {
        continue;
      }
      const auto found = std::find_if(view.corners.begin(), view.corners.end(),
                                      [index](const BoardCorner& corner) { return corner.index == index; });
      const bool near = found != view.corners.end() && (found->pixel - *predicted).norm() < max_error_px;
      const auto pixel = refiner.refine(index, near ? found->pixel : *predicted, 2.0 * max_error_px);
      if (pixel.has_value() && (*pixel - *predicted).norm() < max_error_px) {
        refined.corners.push_back({index, *pixel});
      }
    }
    // A view with mostly wrong corners is judged by its original detections.
    return 2 * refined.corners.size() < view.corners.size() ? view : refined;
  }

  // Returns true if anything changed.
  bool removeOutliers() {
    const size_t count = fit_.views.size();
    std::vector<double> widths_px(count);
    std::vector<double> view_medians_px(count);
    std::vector<double> all_errors_px;
    for (size_t v = 0; v < count; ++v) {
      std::vector<double> errors_px;
      for (const BoardCorner& corner : fit_.views[v].corners) {
        errors_px.push_back(
            reprojectionError(board_, corner, fit_.camera.boards[v], fit_.camera.model).norm());
      }
      view_medians_px[v] = median(errors_px);
      all_errors_px.insert(all_errors_px.end(), errors_px.begin(), errors_px.end());
    }
    const double usual_corner_px = median(all_errors_px);
    std::vector<BoardView> refined(count);
    std::vector<double> errors_px(count);
    tbb::parallel_for(size_t{0}, count, [&](size_t v) {
      widths_px[v] = widthOf(v);
      // A corner of a noisy view is compared with the noise of that view.
      refined[v] = refineView(v, kMaxCornerError * std::max(usual_corner_px, view_medians_px[v]));
      errors_px[v] = rmsError(board_, refined[v], fit_.camera.boards[v], fit_.camera.model);
    });
    const double usual_px = median(errors_px);
    const double usual_width_px = median(widths_px);
    bool changed = false;
    std::vector<BoardView> kept;
    for (size_t v = 0; v < count; ++v) {
      const bool blurred = widths_px[v] > kMaxEdgeWidth * usual_width_px;
      if (blurred || !(errors_px[v] <= kMaxViewError * usual_px)) {
        fit_.rejected.push_back(
            {fit_.views[v].image, blurred ? "blurred: its edges are " + toText(widths_px[v], 1) +
                                                " px wide, usual are " + toText(usual_width_px, 1) + " px"
                                          : "its error of " + toText(errors_px[v], 2) + " px RMS is " +
                                                toText(errors_px[v] / usual_px, 1) + " times the usual one"});
        changed = true;
        continue;
      }
      changed = changed || !sameCorners(refined[v], fit_.views[v]);
      kept.push_back(refined[v]);
    }
    fit_.views = kept;
    return changed;
  }

  const CalibrationBoard& board_;
  const IntrinsicCalibrationOptions& options_;
  std::map<std::string, cv::Mat> images_;
  ViewFit fit_{{CameraModel(PinholeCamera(PinholeCamera::Parameters::Ones())), {}}, {}, {}, {}, {}, 0.0};
};

}  // namespace

double median(const std::vector<double>& values) {
  return values.empty() ? 0.0 : quantile(values, 0.5);
}

double rmsError(const CalibrationBoard& board, const BoardView& view, const PosedBoard& posed,
                const CameraModel& model) {
  double sum = 0.0;
  for (const BoardCorner& corner : view.corners) {
    sum += reprojectionError(board, corner, posed, model).squaredNorm();
  }
  const double rms = std::sqrt(sum / (2.0 * static_cast<double>(view.corners.size())));
  return std::isfinite(rms) ? rms : std::numeric_limits<double>::infinity();
}

std::optional<ViewFit> fitViews(const CalibrationBoard& board, const std::vector<CalibrationImage>& images,
                                const std::vector<BoardView>& views, const CameraModel& rough,
                                const IntrinsicCalibrationOptions& options) {
  return ViewFitter(board, images, views, options).run(rough);
}

}  // namespace vcharge
