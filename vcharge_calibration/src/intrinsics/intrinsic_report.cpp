#include "vcharge_calibration/intrinsics/intrinsic_report.h"

#include <algorithm>
#include <cmath>
#include <map>
#include <sstream>

#include "intrinsics/intrinsic_optimizer.h"
#include "report/report_pictures.h"
#include "vcharge_core/base/text_format.h"
#include "vcharge_core/files/html.h"

namespace vcharge {

namespace {

constexpr double kDegrees = 57.29577951308232;
constexpr double kVectorScale = 100.0;
constexpr double kSideYaw_rad = 1.0;

class Report {
 public:
  Report(const CalibrationBoard& board, const std::vector<CalibrationImage>& images,
         const IntrinsicCalibration& result)
      : board_(board), result_(result) {
    for (const CalibrationImage& image : images) {
      images_[image.name] = image.pixels;
    }
  }

  std::string make(const std::string& title) {
    writeVerdict();
    if (result_.model.has_value()) {
      writeParameters();
    }
    if (!result_.views.empty()) {
      writePictures();
    }
    writeImages();
    return htmlPage(title, out_.str());
  }

 private:
  void writeVerdict() {
    out_ << htmlVerdict(toString(result_.verdict), result_.remarks);
    if (result_.views.empty()) {
      return;
    }
    out_ << "<table>";
    const auto row = [this](const std::string& name, const std::string& value) {
      out_ << htmlRow({name, value});
    };
    row("board", board_.description() + ", " + toText(1000.0 * board_.square_m, 1) + " mm");
    row("images used", std::to_string(result_.views.size()) + " of " +
                           std::to_string(result_.views.size() + result_.rejected.size()));
    row("error, RMS per coordinate", toText(result_.rms_px, 3) + " px");
    row("error, mean distance", toText(result_.mean_error_px, 3) + " px");
    row("error of views excluded from the fit (cross-validation), RMS",
        toText(result_.cross_validated_px, 3) + " px");
    if (result_.bent_boards) {
      row("boards bend by (RMS)", toText(1000.0 * result_.bending_m, 1) +
                                      " mm; with flat boards, the error is " +
                                      toText(result_.flat_rms_px, 3) + " px RMS");
    }
    row("image covered", toText(100.0 * result_.covered_fraction, 0) + " %, up to " +
                             toText(kDegrees * result_.max_angle_rad, 0) + " degrees from the axis");
    out_ << "</table>";
  }

  void writeParameters() {
    out_ << "<h2>Parameters (" << escapeHtml(result_.model->name())
         << ")</h2><table><tr><th>name</th><th>value</th><th>standard deviation</th></tr>";
    const std::vector<std::string> names = result_.model->parameterNames();
    const Eigen::VectorXd values = result_.model->parameters();
    for (size_t i = 0; i < names.size(); ++i) {
      const auto k = static_cast<Eigen::Index>(i);
      out_ << "<tr><td>" << names[i] << "</td><td>" << toText(values[k], 6) << "</td><td>"
           << toText(result_.standard_deviations[k], 6) << "</td></tr>";
    }
    out_ << "</table>";
  }

  void writePictures() {
    std::vector<BoardView> views;
    std::vector<CornerError> errors;
    for (const CalibratedView& view : result_.views) {
      views.push_back(view.view);
      if (!result_.model.has_value()) {
        continue;
      }
      for (const BoardCorner& corner : view.view.corners) {
        errors.push_back({corner.pixel, reprojectionError(board_, corner, view.posed, *result_.model)});
      }
    }
    out_ << "<h2>Coverage of the image</h2><div class=\"row\">"
         << htmlFigure(drawCoverage(result_.image_size_px, views),
                       "Corners of all used images. Red: no image shows the board there.");
    if (!result_.model.has_value()) {
      out_ << "</div>";
      return;
    }
    out_ << htmlFigure(drawErrorMap(result_.image_size_px, errors), "RMS error per coordinate, pixels.")
         << "</div><h2>Errors</h2><div class=\"row\">"
         << htmlFigure(drawErrorVectors(result_.image_size_px, errors, kVectorScale),
                       "Errors of all corners, " + toText(kVectorScale, 0) +
                           " times enlarged. Where neighbours point in the same direction, the model of lens "
                           "or board "
                           "is not exact.");
    const CalibratedView& shown = *std::max_element(result_.views.begin(), result_.views.end(),
                                                    [](const CalibratedView& a, const CalibratedView& b) {
                                                      return a.view.corners.size() < b.view.corners.size();
                                                    });
    const auto image = images_.find(shown.view.image);
    if (image != images_.end()) {
      out_ << htmlFigure(embedPicture(drawCorners(image->second, board_, shown.view), 640),
                         shown.view.image + " with its corners; red: the first, blue: the first row.")
           << "</div><h2>Undistorted views</h2><div class=\"row\">";
      for (const auto& [yaw_rad, name] :
           {std::pair<double, const char*>{-kSideYaw_rad, "left"}, {0.0, "ahead"}, {kSideYaw_rad, "right"}}) {
        out_ << htmlFigure(embedPicture(undistortedView(image->second, *result_.model, yaw_rad), 360),
                           std::string("to the ") + name + ": straight edges must be straight");
      }
    }
    out_ << "</div>";
  }

  void writeImages() {
    out_ << "<h2>Images</h2><table><tr><th>image</th><th>corners</th><th>error, px RMS</th><th></th>"
            "<th>edges, px</th><th>distance, m</th><th class=\"text\">left out because</th></tr>";
    double worst_px = 1e-9;
    for (const CalibratedView& view : result_.views) {
      worst_px = std::max(worst_px, view.rms_px);
    }
    for (const CalibratedView& view : result_.views) {
      out_ << "<tr><td>" << escapeHtml(view.view.image) << "</td><td>" << view.view.corners.size() << " of "
           << board_.numCorners() << "</td><td>" << toText(view.rms_px, 3)
           << "</td><td><svg class=\"bar\" viewBox=\"0 0 100 10\" preserveAspectRatio=\"none\"><rect width=\""
           << toText(100.0 * view.rms_px / worst_px, 0)
           << "\" height=\"10\" fill=\"#b3261e\"/></svg></td><td>" << toText(view.edge_width_px, 1)
           << "</td><td>" << toText(view.posed.camera_from_board.translation().norm(), 2)
           << "</td><td class=\"text\"></td></tr>";
    }
    for (const RejectedImage& image : result_.rejected) {
      out_ << "<tr><td>" << escapeHtml(image.name) << "</td><td></td><td></td><td></td><td></td><td></td>"
           << "<td class=\"text\">" << escapeHtml(image.reason) << "</td></tr>";
    }
    out_ << "</table>";
  }

  const CalibrationBoard& board_;
  const IntrinsicCalibration& result_;
  std::map<std::string, cv::Mat> images_;
  std::ostringstream out_;
};

}  // namespace

std::string makeIntrinsicReport(const std::string& title, const CalibrationBoard& board,
                                const std::vector<CalibrationImage>& images,
                                const IntrinsicCalibration& result) {
  return Report(board, images, result).make(title);
}

}  // namespace vcharge
