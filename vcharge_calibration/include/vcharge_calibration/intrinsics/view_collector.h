#pragma once

#include <optional>
#include <string>
#include <vector>

#include "vcharge_calibration/boards/board_detector.h"
#include "vcharge_calibration/boards/calibration_board.h"
#include "vcharge_calibration/intrinsics/image_coverage.h"
#include "vcharge_calibration/intrinsics/intrinsic_calibration.h"
#include "vcharge_core/camera/camera_model.h"

namespace vcharge {

/// Options of ViewCollector. Lengths in the image are over its longer side.
struct ViewCollectorOptions {
  double max_motion = 0.004;     ///< of the board's corners since the last image: it must be held still
  double min_difference = 0.06;  ///< of the corners from those of any view taken, unless it shows a new part
  int enough_views = 25;
  double enough_coverage = 0.7;  ///< share of the image
  int enough_tilted = 6;         ///< views in which the board is tilted
  int max_views = 100;           ///< then nothing more is taken

  template <class Visitor>
  void visitFields(Visitor&& visit) {
    visit("max_motion", max_motion);
    visit("min_difference", min_difference);
    visit("enough_views", enough_views);
    visit("enough_coverage", enough_coverage);
    visit("enough_tilted", enough_tilted);
    visit("max_views", max_views);
  }
  void validate() const;  ///< throws std::invalid_argument naming the field
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
  double coveredShare() const { return coverage_.has_value() ? coverage_->coveredShare() : 0.0; }
  /// Which images are still missing; empty if there are enough.
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
