#include "vcharge_calibration/report/rig_report.h"

#include <cmath>
#include <utility>
#include <vector>

#include "matching/rectified_matches.h"
#include "report/bird_view.h"
#include "report/report_pictures.h"
#include "report/rig_pictures.h"
#include "vcharge_calibration/rig/rig_calibration_text.h"
#include "vcharge_core/base/text_format.h"
#include "vcharge_core/files/html.h"

namespace vcharge {
namespace {

constexpr double kDegrees = 57.29577951308232;
constexpr int kPictureWidth_px = 450;
constexpr int kPairWidth_px = 1120;
constexpr double kVectorScale = 50.0;
const std::vector<double> kSeamDistances_m = {2.0, 5.0, 10.0};

std::string summaryOf(const RigCalibration& result) {
  return "<table>" +
         htmlRow({"drive", toText(result.distance_m, 1) + " m, " +
                               toText(kDegrees * result.left_turn_rad, 0) + " degrees to the left, " +
                               toText(kDegrees * result.right_turn_rad, 0) + " to the right"}) +
         htmlRow({"map", std::to_string(result.num_keyframes) + " keyframes, " +
                             std::to_string(result.num_landmarks) + " landmarks, " +
                             std::to_string(result.num_loop_edges) + " loop edges"}) +
         htmlRow({"reprojection error, RMS per coordinate", toText(result.rms_px, 3) + " px"}) +
         htmlRow({"odometer's turn, true over counted", toText(result.odometer_turn_scale, 5)}) +
         htmlRow({"delay of the odometer's stamps", toText(1000.0 * result.time_offset_s, 1) + " ms"}) +
         htmlRow({"height", result.height_source}) + "</table>";
}

/// Table row of each degree of freedom and its standard deviation; the angles are zero for an upright camera
/// that looks forward.
std::string parametersOf(const RigCalibration& result) {
  std::string text =
      "<h2>Extrinsics</h2><p>Axes of the vehicle: x forwards, y to the left, z up. " +
      std::string(result.is_from_map ? "The map" : "The odometer") +
      " defines the scale, which is known within " + toText(100.0 * result.rig->scale_sigma, 2) +
      " %; this is not in the deviations of the positions." +
      " Yaw, pitch and roll are zero for an upright camera that looks forward; their deviations are about "
      "the "
      "vehicle's z, y and x.</p><table>" +
      htmlRow({"camera", "x (cm)", "y (cm)", "z (cm)", "yaw (degrees)", "pitch", "roll", "least certain"},
              true);
  for (size_t i = 0; i < result.cameras.size(); ++i) {
    const CameraCalibration& camera = result.cameras[i];
    const Eigen::Matrix<double, 6, 1> values = positionAndAngles(*result.rig->cameras[i].vehicle_from_camera);
    const Eigen::Matrix<double, 6, 1> sigmas = positionAndAngleSigmas(camera.covariance);
    std::vector<std::string> cells{camera.name};
    for (int k = 0; k < 6; ++k) {
      const int digits = k < 3 ? 2 : 3;
      cells.push_back(toText(values[k], digits) + " \u00b1 " + toText(sigmas[k], digits));
    }
    cells.push_back(camera.weakest_direction);
    text += htmlRow(cells);
  }
  return text + "</table>";
}

std::string checksOf(const RigCalibration& result) {
  std::string text =
      "<h2>Checks</h2><table>" +
      htmlRow({"camera", "observations tracked", "adjusted", "error (px RMS)", "common to neighbours (px)",
               "landmarks shared with other cameras", "difference of the halves of the drive (cm)",
               "(degrees)", "largest ratio of jackknife to formula"},
              true);
  for (const CameraCalibration& camera : result.cameras) {
    text += htmlRow({camera.name, std::to_string(camera.num_tracked), std::to_string(camera.num_observations),
                     toText(camera.rms_px, 3), toText(camera.structure_px, 3),
                     std::to_string(camera.num_common_landmarks),
                     toText(100.0 * camera.half_difference.head<3>().norm(), 2),
                     toText(kDegrees * camera.half_difference.tail<3>().norm(), 3),
                     toText(camera.inflation.maxCoeff(), 1)});
  }
  return text + "</table>";
}

std::string row(const std::string& figures) {
  return "<div class=\"row\">" + figures + "</div>";
}

std::string mapsOf(const RigCalibration& result, const ReconstructionState& state) {
  std::string figures;
  if (result.first_scene != nullptr) {
    figures += htmlFigure(drawSparseMap(*result.first_scene),
                          "Before: landmarks by the odometer's path and hand-eye's rig, in the colour of the "
                          "camera that observed them first.");
  }
  return "<h2>Sparse map</h2>" + row(figures + htmlFigure(drawSparseMap(makeRigScene(state.data)),
                                                          "After: landmarks by the adjusted path and rig."));
}

std::string seamsOf(const RigCalibration& result, const KeyframeImages& images) {
  const CameraRig* before = result.first_scene != nullptr ? result.first_scene->rig.get() : nullptr;
  const CameraRig& rig = *result.rig;
  std::string text = "<h2>The ground from above</h2>";
  const std::vector<int32_t> keyframes = images.keyframes();
  if (!keyframes.empty()) {
    std::vector<cv::Mat> shown;
    for (size_t i = 0; i < rig.cameras.size(); ++i) {
      shown.push_back(images.image(keyframes[keyframes.size() / 2], i));
    }
    std::string figures;
    if (before != nullptr) {
      figures +=
          htmlFigure(embedPicture(makeBirdView(*before, shown, BirdViewArea()), kPictureWidth_px),
                     "Before: by the initial estimate. Lines mark the seams between cameras; with correct "
                     "extrinsics road markings continue across them.");
    }
    text += row(figures + htmlFigure(embedPicture(makeBirdView(rig, shown, BirdViewArea()), kPictureWidth_px),
                                     "After: by the calibrated rig. The vehicle drives upwards."));
  }
  text +=
      "<p>Distance between the projections of a ground point half way between two neighbouring cameras: "
      "\u00b1 one standard deviation after the calibration, for independent errors (an upper bound, since "
      "those "
      "of height and tilt are largely common); in brackets, the distance by the initial estimate.</p><table>";
  std::vector<std::string> head{"cameras"};
  for (const double distance_m : kSeamDistances_m) {
    head.push_back("at " + toText(distance_m, 0) + " m (cm)");
  }
  text += htmlRow(head, true);
  std::vector<std::string> cells;
  for (const SeamPoint& point : seamPoints(rig, before, kSeamDistances_m)) {
    if (cells.empty()) {
      cells.push_back(rig.cameras[point.first].name + ", " + rig.cameras[point.second].name);
    }
    cells.push_back(!point.is_seen                  ? "not seen by both"
                    : !std::isfinite(point.sigma_m) ? "unknown"
                                                    : "\u00b1 " + toText(100.0 * point.sigma_m, 1));
    if (point.is_seen && before != nullptr) {
      cells.back() += " (" + toText(100.0 * point.before_m, 1) + ")";
    }
    if (cells.size() > kSeamDistances_m.size()) {
      text += htmlRow(cells);
      cells.clear();
    }
  }
  return text + "</table>";
}

std::string commonLandmarksOf(const ReconstructionState& state, const KeyframeImages& images) {
  std::string text;
  for (const CameraPairView& pair : findCameraPairViews(state.data, images)) {
    const auto nameOf = [&](size_t camera, int32_t keyframe) {
      return state.data.rig->cameras[camera].name + " at keyframe " + std::to_string(keyframe);
    };
    text += htmlFigure(embedPicture(drawCameraPairView(state.data, images, pair), kPairWidth_px),
                       nameOf(pair.first_camera, pair.first_keyframe) + ", " +
                           nameOf(pair.second_camera, pair.second_keyframe) + ": " +
                           std::to_string(pair.tracks.size()) + " landmarks in both views.");
  }
  return text.empty() ? ""
                      : "<h2>Landmarks that cameras share</h2><p>Views rectified to the mean rotation of the "
                        "two cameras; lines connect the observations of a landmark.</p>" +
                            row(text);
}

std::string errorsOf(const ReconstructionState& state) {
  std::string maps, vectors;
  const std::vector<std::vector<CornerError>> errors = errorsByCamera(state.data);
  for (size_t i = 0; i < errors.size(); ++i) {
    const RigCamera& camera = state.data.rig->cameras[i];
    maps += htmlFigure(drawErrorMap(camera.image_size_px, errors[i]),
                       camera.name + ": RMS error per coordinate, pixels.");
    vectors += htmlFigure(
        drawErrorVectors(camera.image_size_px, meanErrors(camera.image_size_px, errors[i]), kVectorScale),
        camera.name + ": mean errors, " + toText(kVectorScale, 0) +
            " times enlarged. Parallel neighbours show wrong intrinsics.");
  }
  return "<h2>Errors over the images</h2>" + row(maps) + row(vectors);
}

}  // namespace

std::string makeRigReport(const std::string& title, const RigCalibration& result,
                          const ReconstructionState& state, const KeyframeImages& images,
                          const std::string& more_sections) {
  std::string body = htmlVerdict(toString(result.verdict), result.remarks) + summaryOf(result);
  if (result.rig != nullptr) {
    body += parametersOf(result) +
            row(htmlFigure(drawCameras(*result.rig),
                           "Cameras and their directions from above; the vehicle drives to the right.")) +
            checksOf(result);
  }
  // After a failure, poses and landmarks help to find the reason if they exist.
  if (state.data.rig != nullptr && state.data.rig->hasExtrinsics() && !state.data.keyframes.empty()) {
    body += mapsOf(result, state);
    body += result.rig != nullptr ? seamsOf(result, images) : "";
    body += commonLandmarksOf(state, images) + errorsOf(state);
  }
  if (!state.data.keyframes.empty() && !result.is_from_map) {
    body += "<h2>Loops</h2>" + row(htmlFigure(drawLoopGraph(state), "Loop edges on the vehicle's path."));
  }
  body += more_sections + "<h2>Times</h2><table>";
  for (const auto& [stage, seconds] : state.report.stage_s) {
    body += htmlRow({stage, toText(seconds, 1) + " s"});
  }
  return htmlPage(title, body + "</table>");
}

}  // namespace vcharge
