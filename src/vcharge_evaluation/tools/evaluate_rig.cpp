#include <cstdio>

#include "tool_arguments.h"
#include "vcharge_core/camera/camera_rig.h"
#include "vcharge_evaluation/rig_errors.h"

namespace {

using namespace vcharge;

constexpr double kDegrees = 57.29577951308232;

nlohmann::json print(const char* title, const std::vector<CameraErrors>& errors) {
  std::printf("%s\n  %-10s %8s %8s %8s %8s   %8s %8s %8s %8s   %s\n", title, "camera", "x (cm)", "y", "z",
              "total", "x (deg)", "y", "z", "total", "in standard deviations");
  nlohmann::json json = nlohmann::json::array();
  for (const CameraErrors& camera : errors) {
    const Eigen::Vector3d shift_cm = 100.0 * camera.error.head<3>();
    const Eigen::Vector3d turn_deg = kDegrees * camera.error.tail<3>();
    std::printf("  %-10s %8.2f %8.2f %8.2f %8.2f   %8.3f %8.3f %8.3f %8.3f  ", camera.name.c_str(),
                shift_cm.x(), shift_cm.y(), shift_cm.z(), shift_cm.norm(), turn_deg.x(), turn_deg.y(),
                turn_deg.z(), turn_deg.norm());
    nlohmann::json of_camera = {{"camera", camera.name},
                                {"error_m", {camera.error[0], camera.error[1], camera.error[2]}},
                                {"error_rad", {camera.error[3], camera.error[4], camera.error[5]}}};
    if (camera.normalized) {
      of_camera["normalized"] = nlohmann::json::array();
      for (const double value : *camera.normalized) {
        std::printf(" %5.1f", value);
        of_camera["normalized"].push_back(value);
      }
    }
    std::printf("\n");
    json.push_back(of_camera);
  }
  return json;
}

}  // namespace

int main(int argc, char** argv) {
  CommandLine app(
      "Errors of a rig's extrinsics against the truth, per camera and degree of freedom in the axes of the "
      "vehicle. "
      "The common scale, which a calibration from a drive takes from the odometer, is judged apart.");
  std::string estimate, truth;
  app.addOption("--estimate", &estimate, "rig.yaml to judge").required();
  app.addOption("--truth", &truth, "true rig.yaml").required();
  describeJson(&app,
               R"(kind: "rig"; scale: factor on the translations that fits the truth best; scale_sigma: of
the estimate; as_is, without_scale: per camera {camera, error_m [x, y, z], error_rad [x, y, z], normalized [6]:
errors over their standard deviations, if there are covariances}.)");
  return runTool(&app, argc, argv, [&](nlohmann::json* found) {
    const CameraRig rig = readCameraRig(estimate);
    const RigErrors errors = evaluateRig(rig, readCameraRig(truth));
    nlohmann::json json = {{"kind", "rig"}, {"scale", errors.scale}, {"scale_sigma", rig.scale_sigma}};
    json["as_is"] = print("as it is", errors.as_is);
    std::printf("scale: x %.5f\n", errors.scale);
    json["without_scale"] = print("without the common scale", errors.without_scale);
    *found = json;
  });
}
