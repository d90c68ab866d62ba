#include <cstdio>
#include <map>
#include <set>

#include "tool_arguments.h"
#include "vcharge_core/base/progress_bar.h"
#include "vcharge_core/motion/tracked_object_file.h"
#include "vcharge_evaluation/drive_truth.h"
#include "vcharge_evaluation/object_errors.h"

namespace {

using namespace vcharge;

struct Arguments {
  std::string objects, truth;
};

double fractionOf(size_t part, size_t whole) {
  return static_cast<double>(part) / static_cast<double>(std::max<size_t>(1, whole));
}

double percentOf(size_t part, size_t whole) {
  return 100.0 * fractionOf(part, whole);
}

// Prints a row and returns its figures.
nlohmann::json figuresToJson(const std::string& what, const ObjectFigures& figures) {
  std::printf(
      "  %-10s %6zu due, found %5.1f %%; within limits: position %5.1f %%, velocity %5.1f %%, both %5.1f %%; "
      "class right %5.1f %%\n             error median, mean, 95 %%, worst: %.2f %.2f %.2f %.2f m; %.2f %.2f "
      "%.2f %.2f m/s\n",
      what.c_str(), figures.num_due, percentOf(figures.num_found, figures.num_due),
      percentOf(figures.num_good_position, figures.num_due),
      percentOf(figures.num_good_velocity, figures.num_due), percentOf(figures.num_good, figures.num_due),
      percentOf(figures.num_right_class, figures.num_found), figures.position_error_m.percentile_50,
      figures.position_error_m.mean, figures.position_error_m.percentile_95, figures.position_error_m.max,
      figures.velocity_error_m_per_s.percentile_50, figures.velocity_error_m_per_s.mean,
      figures.velocity_error_m_per_s.percentile_95, figures.velocity_error_m_per_s.max);
  return {{"due", figures.num_due},
          {"found", figures.num_found},
          {"good_position", figures.num_good_position},
          {"good_velocity", figures.num_good_velocity},
          {"good", figures.num_good},
          {"right_class", figures.num_right_class},
          {"position_error_m", figures.position_error_m},
          {"centre_error_m", figures.centre_error_m},
          {"velocity_error_m_per_s", figures.velocity_error_m_per_s}};
}

nlohmann::json crossingsToJson(const std::vector<Crossing>& crossings) {
  size_t num_kept = 0;
  nlohmann::json list = nlohmann::json::array();
  for (const Crossing& crossing : crossings) {
    num_kept += crossing.kept() ? 1 : 0;
    list.push_back({{"object", crossing.object},
                    {"class", nameOf(crossing.object_class)},
                    {"from_ns", crossing.from.nanoseconds()},
                    {"to_ns", crossing.to.nanoseconds()},
                    {"due", crossing.num_due},
                    {"found", crossing.num_found},
                    {"ids", crossing.ids},
                    {"kept", crossing.kept()}});
  }
  std::printf("crossings that keep one id: %zu of %zu\n", num_kept, crossings.size());
  return list;
}

nlohmann::json approachesToJson(const std::vector<ObjectApproach>& approaches) {
  nlohmann::json list = nlohmann::json::array();
  size_t num_reported = 0;
  for (const ObjectApproach& approach : approaches) {
    num_reported += approach.reported ? 1 : 0;
    list.push_back({{"object", approach.object},
                    {"class", nameOf(approach.object_class)},
                    {"stamp_ns", approach.stamp.nanoseconds()},
                    {"reported", approach.reported},
                    {"first_reported_m", approach.first_reported_m}});
  }
  if (!approaches.empty()) {
    std::printf("approaches to the standing vehicle reported before 1.5 m: %zu of %zu\n", num_reported,
                approaches.size());
  }
  return list;
}

nlohmann::json firstReportsToJson(const std::vector<FirstObjectReport>& reports) {
  nlohmann::json list = nlohmann::json::array();
  size_t num_never = 0;
  std::vector<double> delays_s;
  for (const FirstObjectReport& report : reports) {
    num_never += report.found ? 0 : 1;
    delays_s.push_back(report.delay_s);
    list.push_back({{"object", report.object},
                    {"class", nameOf(report.object_class)},
                    {"found", report.found},
                    {"delay_s", report.delay_s}});
  }
  const ErrorDistribution delay_s = summarize(delays_s);
  std::printf("time to the first report: median %.2f s, worst %.2f s; %zu of %zu objects never reported\n",
              delay_s.percentile_50, delay_s.max, num_never, reports.size());
  return list;
}

nlohmann::json toJson(const ObjectErrors& errors) {
  std::printf("moving objects in %zu images of %.1f s:\n", errors.num_frames, errors.duration_s);
  nlohmann::json json = {{"kind", "objects"},
                         {"images", errors.num_frames},
                         {"duration_s", errors.duration_s},
                         {"all", figuresToJson("all", errors.all)},
                         {"by_class", nlohmann::json::array()},
                         {"by_distance", nlohmann::json::array()},
                         {"false_objects", nlohmann::json::array()},
                         {"false_per_minute", errors.false_per_minute()}};
  for (const auto& [object_class, figures] : errors.by_class) {
    nlohmann::json entry = figuresToJson(nameOf(object_class), figures);
    entry["class"] = nameOf(object_class);
    json["by_class"].push_back(entry);
  }
  for (const ObjectErrors::DistanceBin& bin : errors.by_distance) {
    char label[32];
    std::snprintf(label, sizeof(label), "%.0f-%.0f m", bin.from_m, bin.to_m);
    nlohmann::json entry = figuresToJson(label, bin.figures);
    entry["from_m"] = bin.from_m;
    entry["to_m"] = bin.to_m;
    json["by_distance"].push_back(entry);
  }
  json["crossings"] = crossingsToJson(errors.crossings);
  json["approaches"] = approachesToJson(errors.approaches);
  json["first_reports"] = firstReportsToJson(errors.first_reports);
  std::printf("false objects: %zu, %.2f per minute\n", errors.false_objects.size(),
              errors.false_per_minute());
  for (const FalseObject& object : errors.false_objects) {
    json["false_objects"].push_back(
        {{"id", object.id}, {"images", object.num_frames}, {"first_ns", object.first.nanoseconds()}});
  }
  std::printf("squared position error by its covariance (honest: 2): mean %.2f; %.1f %% within 95 %%\n",
              errors.normalized_error.mean,
              percentOf(errors.num_normalized_within_95, errors.normalized_error.count));
  json["normalized_error"] = errors.normalized_error;
  json["normalized_within_95"] = errors.num_normalized_within_95;
  json["worst_ns"] = errors.worst ? nlohmann::json(errors.worst->nanoseconds()) : nlohmann::json();
  return json;
}

// Reports by stamp. Each stamp is one of an image of the drive.
std::map<Timestamp, ObjectFrame> readReports(const std::string& folder, const DriveTruth& truth) {
  std::map<Timestamp, ObjectFrame> reports;
  for (const ObjectFrame& frame : readObjects(folder)) {
    if (truth.poseAt(frame.stamp) == nullptr) {
      throw InputError(folder + "/objects_frames.csv: stamp_ns: expected stamps of the drive's images, got " +
                       std::to_string(frame.stamp.nanoseconds()));
    }
    reports[frame.stamp] = frame;
  }
  return reports;
}

// The movers at an image, and how much of each the cameras see.
TrueObjectFrame trueFrameAt(Timestamp stamp, DriveTruth* truth, size_t* num_points) {
  TrueObjectFrame frame;
  frame.stamp = stamp;
  frame.world_from_vehicle = *truth->poseAt(stamp);
  for (const TruthMover& mover : truth->moversAt(stamp)) {
    frame.objects.push_back(mover.object);
  }
  frame.visible_fraction.assign(frame.objects.size(), 0.0);
  for (size_t camera = 0; camera < truth->rig().cameras.size(); ++camera) {
    const std::vector<SeenPoint> points = truth->pointsOf(camera, stamp, 1);
    *num_points += points.size();
    const std::vector<size_t> counts = countPointsOn(frame.objects, points);
    const auto num_pixels = static_cast<double>(truth->rig().cameras[camera].image_size_px.area());
    for (size_t i = 0; i < counts.size(); ++i) {
      frame.visible_fraction[i] =
          std::max(frame.visible_fraction[i], static_cast<double>(counts[i]) / num_pixels);
    }
  }
  return frame;
}

nlohmann::json evaluate(const Arguments& arguments, const ObjectEvaluationOptions& options) {
  DriveTruth truth(arguments.truth);
  std::map<Timestamp, ObjectFrame> reports = readReports(arguments.objects, truth);
  ObjectEvaluator evaluator(options);
  size_t num_points = 0, num_judged = 0;
  ProgressBar progress("evaluating");
  for (const StampedTransform& image : truth.trajectory()) {
    progress.update(static_cast<double>(num_judged++) / static_cast<double>(truth.trajectory().size()));
    ObjectFrame& reported = reports[image.stamp];  // nothing was reported where there is none yet
    reported.stamp = image.stamp;
    evaluator.add(trueFrameAt(image.stamp, &truth, &num_points), reported);
  }
  if (num_points == 0) {
    throw InputError(arguments.truth +
                     "/range: no true ranges for any image (simulate the drive with --truth-range)");
  }
  return toJson(evaluator.errors());
}

}  // namespace

int main(int argc, char** argv) {
  CommandLine app("Errors of tracked moving objects against the truth of a simulated drive.");
  Arguments arguments;
  app.addOption("--objects", &arguments.objects,
                "folder with objects.csv and objects_frames.csv, as detect_obstacles writes them")
      .required();
  app.addOption("--truth", &arguments.truth,
                "folder of the drive's truth (range/, rig.yaml, trajectory.tum, movers.yaml)")
      .required();
  const OptionsArgument<ObjectEvaluationOptions> options(&app);
  const ReportArgument report(&app, "object_errors");
  describeJson(&app, R"(kind: "objects"; images, duration_s; all: {due: number of judged objects over all
images, found, good_position, good_velocity, good (both), right_class, error distributions position_error_m (of the point
nearest to the vehicle), centre_error_m, velocity_error_m_per_s, in which a missed object counts as 1 m and 1 m/s}; the same
in by_class [{class}] and by_distance [{from_m, to_m}]; crossings (an object due for 1 s and more without interruption)
[{object, class, from_ns, to_ns, due, found, ids, kept: half found with one id}]; first_reports [{object, class, found,
delay_s: since it moved visibly and near; the whole drive if it never was}]; false_objects [{id, images, first_ns}],
false_per_minute; error distribution normalized_error (squared centre error by the covariance), normalized_within_95: number
within the 95 % of a normal error; worst_ns: image with the largest errors, or null. An image without a report counts as one
that reports nothing.)");
  return runTool(&app, argc, argv, [&](nlohmann::json* found) {
    if (options.shown()) {
      return;
    }
    *found = evaluate(arguments, options.read());
    report.write(*found);
  });
}
