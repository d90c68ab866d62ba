#include "vcharge_simulation/faults/fault_truth.h"

#include <type_traits>

#include <yaml-cpp/yaml.h>

#include "vcharge_core/files/file_io.h"

namespace vcharge {

void writeFaults(const FaultOptions& faults, Timestamp start, const std::vector<std::string>& cameras,
                 const ImageFaults::Hits& hits,
                 const std::vector<std::vector<ExposureFaults::Record>>& exposures, const std::string& path) {
  const auto stampAt = [&](double time_s) { return (start + durationFromSeconds(time_s)).nanoseconds(); };
  const auto stampsOf = [&](const std::vector<std::vector<Timestamp>>& hits_of_camera) {
    YAML::Node node(YAML::NodeType::Map);
    for (size_t i = 0; i < cameras.size(); ++i) {
      for (const Timestamp stamp : hits_of_camera[i]) {
        node[cameras[i]].push_back(stamp.nanoseconds());
      }
    }
    return node;
  };
  YAML::Node root;
  root["faults"] = YAML::Node(YAML::NodeType::Sequence);
  forEachOption(faults, [&](const OptionDeclaration& option, const auto& fault) {
    using Fault = std::decay_t<decltype(fault)>;
    if (!fault.isActive()) {
      return;
    }
    YAML::Node entry(YAML::NodeType::Map);
    entry["kind"] = option.name;
    for (const auto& field : writeFields(fault)) {
      entry[field.first] = field.second;
    }
    if constexpr (std::is_base_of_v<FaultInterval, Fault>) {
      entry["start_stamp_ns"] = stampAt(fault.start_s);
      if (fault.end_s > 0.0) {
        entry["end_stamp_ns"] = stampAt(fault.end_s);
      }
    }
    if constexpr (std::is_same_v<Fault, CounterResetFault>) {
      entry["start_stamp_ns"] = stampAt(fault.time_s);
    }
    if constexpr (std::is_same_v<Fault, DroppedImagesFault>) {
      entry["images_ns"] = stampsOf(hits.dropped);
    }
    if constexpr (std::is_same_v<Fault, LateImagesFault>) {
      entry["images_ns"] = stampsOf(hits.late);
    }
    if constexpr (std::is_same_v<Fault, AutoExposureFault>) {
      for (size_t i = 0; i < cameras.size(); ++i) {
        for (const ExposureFaults::Record& record : exposures[i]) {
          YAML::Node image(YAML::NodeType::Map);
          image.SetStyle(YAML::EmitterStyle::Flow);
          image["stamp_ns"] = record.stamp.nanoseconds();
          image["exposure_time_s"] = record.time_s;
          image["gain"] = record.gain;
          entry["exposures"][cameras[i]].push_back(image);
        }
      }
    }
    root["faults"].push_back(entry);
  });
  YAML::Emitter emitter;
  emitter << root;
  writeTextFileAtomically(path, std::string(emitter.c_str()) + "\n");
}

}  // namespace vcharge
