#include "intrinsics/image_orientation.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <limits>

#include <tbb/parallel_for.h>

#include "intrinsics/view_fit.h"

namespace vcharge {

namespace {

struct Turn {
  const char* how;
  bool left_right, up_down;
};
constexpr std::array<Turn, 3> kTurns = {{{"mirrored left-right", true, false},
                                         {"mirrored up-down", false, true},
                                         {"turned by 180 degrees", true, true}}};
constexpr int kMaxIterations = 4;
// Turning a view back must reduce its error at least by this factor.
constexpr double kMinGain = 2.0;
// A view that was turned back may have at most this multiple of the usual error.
constexpr double kMaxUsual = 3.0;
// With equally many turned and upright images, the fitted principal point lies in the middle. The search
// therefore starts at this offset from it, as a fraction of the image size.
constexpr double kStartShift = 0.01;

BoardView turned(const BoardView& view, const Turn& turn, cv::Size size) {
  BoardView result = view;
  for (BoardCorner& corner : result.corners) {
    corner.pixel = {turn.left_right ? size.width - 1 - corner.pixel.x() : corner.pixel.x(),
                    turn.up_down ? size.height - 1 - corner.pixel.y() : corner.pixel.y()};
  }
  return result;
}

double errorOf(const CalibrationBoard& board, const BoardView& view, const CameraModel& model) {
  const auto posed = fitBoard(board, view, model, {Loss::kRobust});
  return posed.has_value() ? rmsError(board, view, *posed, model) : std::numeric_limits<double>::infinity();
}

CameraModel shifted(const CameraModel& model, const Turn& turn, cv::Size size) {
  const std::vector<std::string> names = model.parameterNames();
  Eigen::VectorXd parameters = model.parameters();
  for (size_t i = 0; i < names.size(); ++i) {
    auto& value = parameters[static_cast<Eigen::Index>(i)];
    value += turn.left_right && (names[i] == "u0" || names[i] == "cx") ? kStartShift * size.width : 0.0;
    value += turn.up_down && (names[i] == "v0" || names[i] == "cy") ? kStartShift * size.height : 0.0;
  }
  return CameraModel::create(model.name(), parameters);
}

// Finds the turned views by alternating between the assignment of views and a fit of the camera.
std::vector<bool> assign(const CalibrationBoard& board, const std::vector<BoardView>& views, cv::Size size,
                         const Turn& turn, CameraModel model, std::vector<double>* as_is_px,
                         std::vector<double>* turned_px) {
  std::vector<bool> is_turned(views.size(), false);
  as_is_px->assign(views.size(), 0.0);
  turned_px->assign(views.size(), 0.0);
  for (int iteration = 0; iteration < kMaxIterations; ++iteration) {
    std::vector<BoardView> upright = views;
    std::vector<bool> next(views.size(), false);
    tbb::parallel_for(size_t{0}, views.size(), [&](size_t v) {
      const BoardView other = turned(views[v], turn, size);
      (*as_is_px)[v] = errorOf(board, views[v], model);
      (*turned_px)[v] = errorOf(board, other, model);
      if ((*turned_px)[v] < (*as_is_px)[v]) {
        upright[v] = other;
      }
    });
    for (size_t v = 0; v < views.size(); ++v) {
      next[v] = (*turned_px)[v] < (*as_is_px)[v];
    }
    const auto camera = fitCamera(board, upright, model, {Loss::kRobust});
    const bool settled = iteration > 0 && next == is_turned;
    is_turned = next;
    if (!camera.has_value() || settled) {
      break;
    }
    model = camera->model;
  }
  return is_turned;
}

}  // namespace

std::vector<TurnedImage> findTurnedImages(const CalibrationBoard& board, const std::vector<BoardView>& views,
                                          cv::Size image_size_px, const CameraModel& fitted) {
  std::vector<TurnedImage> best;
  double best_px = std::numeric_limits<double>::infinity();
  for (const Turn& turn : kTurns) {
    for (const CameraModel& start : {fitted, shifted(fitted, turn, image_size_px)}) {
      std::vector<double> as_is_px;
      std::vector<double> turned_px;
      const std::vector<bool> is_turned =
          assign(board, views, image_size_px, turn, start, &as_is_px, &turned_px);
      std::vector<double> errors_px;
      for (size_t v = 0; v < views.size(); ++v) {
        errors_px.push_back(std::min(as_is_px[v], turned_px[v]));
      }
      const double usual_px = median(errors_px);
      std::array<std::vector<TurnedImage>, 2> sides;
      for (size_t v = 0; v < views.size(); ++v) {
        const double better_px = errors_px[v];
        const double worse_px = std::max(as_is_px[v], turned_px[v]);
        if (worse_px > kMinGain * better_px && better_px < kMaxUsual * usual_px) {
          sides[is_turned[v] ? 1 : 0].push_back({views[v].image, turn.how});
        }
      }
      const auto& fewer = sides[0].size() < sides[1].size() ? sides[0] : sides[1];
      if (!fewer.empty() && usual_px < best_px) {
        best_px = usual_px;
        best = fewer;
      }
    }
  }
  return best;
}

}  // namespace vcharge
