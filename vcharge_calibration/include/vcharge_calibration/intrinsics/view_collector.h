#pragma once

#include <optional>
#include <string>
#include <vector>

#include "vcharge_calibration/boards/board_detector.h"
#include "vcharge_calibration/boards/calibration_board.h"
#include "vcharge_calibration/intrinsics/image_coverage.h"
#include "vcharge_calibration/intrinsics/intrinsic_calibration.h"
#include "vcharge_core/base/options.h"
#include "vcharge_core/camera/camera_model.h"

namespace vcharge {

struct ViewCollectorOptions {
  VCHARGE_BEGIN_OPTIONS(ViewCollectorOptions);
  VCHARGE_OPTION(int, enough_views, 25, atLeast(5), "Number of images to collect.");
  VCHARGE_OPTION(double, enough_coverage, 0.7, above(0.0).upTo(1.0), "Fraction of the image to cover.");
  VCHARGE_OPTION(int, enough_tilted, 6, notNegative(), "Number of images of the tilted board to collect.");
  VCHARGE_END_OPTIONS();
};

/// Selects from a stream of images those that show a static board in a new pose, until there are enough to
/// calibrate. Not thread safe.
class ViewCollector {
 public:
  enum class Outcome { kTaken, kNoBoard, kMoving, kNothingNew, kFull };

  ViewCollector(const CalibrationBoard& board, std::string model_name,
                const ViewCollectorOptions& options = ViewCollectorOptions());

  /// Copies the image if it is selected. Throws InputError for an image of another size than the first.
  Outcome add(const CalibrationImage& image);

  const std::vector<CalibrationImage>& images() const { return images_; }
  const std::vector<BoardView>& views() const { return views_; }
  /// The board in the last image, if it was detected.
  const std::optional<BoardView>& lastView() const { return last_view_; }
  double coveredFraction() const { return coverage_.has_value() ? coverage_->coveredFraction() : 0.0; }
  /// Describes the images that are still missing; empty if there are enough.
  std::vector<std::string> missing() const;

 private:
  std::optional<BoardView> detect(const CalibrationImage& image) const;
  double difference(const BoardView& a, const BoardView& b) const;
  bool isTilted(const BoardView& view) const;

  const CalibrationBoard board_;
  const std::string model_name_;
  const ViewCollectorOptions options_;
  const BoardDetector detector_;
  std::vector<CalibrationImage> images_;
  std::vector<BoardView> views_;
  std::optional<BoardView> last_view_;
  std::optional<ImageCoverage> coverage_;
  std::optional<CameraModel> rough_model_;
  cv::Size size_;
};

/// The outcome in words.
std::string toString(ViewCollector::Outcome outcome);

}  // namespace vcharge
