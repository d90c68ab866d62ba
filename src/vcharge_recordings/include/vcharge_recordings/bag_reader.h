#pragma once

#include <cstdint>
#include <map>
#include <memory>
#include <optional>
#include <set>
#include <string>
#include <string_view>
#include <vector>

#include <ros/message_traits.h>
#include <ros/serialization.h>
#include <ros/time.h>
#include <sensor_msgs/CompressedImage.h>
#include <sensor_msgs/Image.h>
#include <boost/make_shared.hpp>
#include <boost/shared_ptr.hpp>

#include "vcharge_core/base/error.h"

namespace vcharge {

namespace internal {

class BagBytes;
class BagFile;
struct BagRecord;

/// Throws StreamOverrunException if an image's array is longer than the message. roscpp would first allocate
/// the claimed length, up to 4 GB.
template <class Message>
void requireWholeArrays(ros::serialization::IStream /*stream*/) {}
template <>
void requireWholeArrays<sensor_msgs::Image>(ros::serialization::IStream stream);
template <>
void requireWholeArrays<sensor_msgs::CompressedImage>(ros::serialization::IStream stream);

}  // namespace internal

/// The position of a message in a bag, and when it was recorded.
struct BagEntry {
  ros::Time time;
  uint32_t connection;  ///< index into the reader's connections
  uint32_t chunk;       ///< index into the reader's chunks
  uint32_t offset;      ///< in bytes, inside the decompressed chunk
};

/// A message as it was recorded. Valid until the reader reads the next one.
class BagMessage {
 public:
  /// "<bag>: <topic>"
  const std::string& source() const { return source_; }

  /// InputError naming bag and topic if the message was recorded with another definition than this program
  /// was built with, or is damaged.
  template <class Message>
  boost::shared_ptr<Message> instantiate() const {
    const char* const type = ros::message_traits::datatype<Message>();
    if (md5sum_ != ros::message_traits::md5sum<Message>()) {
      throw InputError(source_ + ": expected the message definition of " + type +
                       " that this program was built with, got another");
    }
    // The cast is safe, since the stream only reads.
    ros::serialization::IStream stream(reinterpret_cast<uint8_t*>(const_cast<char*>(bytes_.data())),
                                       static_cast<uint32_t>(bytes_.size()));
    const auto message = boost::make_shared<Message>();
    try {
      internal::requireWholeArrays<Message>(stream);
      ros::serialization::deserialize(stream, *message);
    } catch (const ros::serialization::StreamOverrunException&) {
      throw InputError(source_ + ": corrupt message: expected all of a " + type + ", got " +
                       std::to_string(bytes_.size()) + " bytes");
    }
    return message;
  }

 private:
  friend class BagReader;
  BagMessage(std::string source, const std::string& md5sum, std::string_view bytes)
      : source_(std::move(source)), md5sum_(md5sum), bytes_(bytes) {}

  std::string source_;
  const std::string& md5sum_;
  std::string_view bytes_;
};

/// Reads bags of format 2.0 (http://wiki.ros.org/Bags/Format/2.0), plain or with chunks compressed by bz2 or
/// lz4. Every length and position in the file is checked before it is used; librosbag reads beyond its
/// buffers in a damaged bag. Opening reads the index and the headers of chunks, not the messages; at most one
/// message, or one decompressed chunk, is in memory.
class BagReader {
 public:
  /// InputError naming the bag, the byte and what was expected there, for a bag that is damaged, encrypted,
  /// of another format or was not finished.
  explicit BagReader(std::string path);
  ~BagReader();
  BagReader(const BagReader&) = delete;
  BagReader& operator=(const BagReader&) = delete;

  /// Topics that have messages, with their types.
  const std::map<std::string, std::set<std::string>>& topics() const { return topics_; }
  /// All messages of these topics by the time of their recording; equal times in the order of the bag.
  std::vector<BagEntry> entries(const std::set<std::string>& topics) const;
  const std::string& topicOf(const BagEntry& entry) const { return connections_[entry.connection].topic; }
  /// InputError if the message or its chunk is damaged.
  BagMessage read(const BagEntry& entry);

 private:
  struct Connection {
    uint32_t id;
    std::string topic, type, md5sum;
  };
  struct Chunk {
    uint64_t offset;       ///< position of its data
    uint32_t stored_size;  ///< in the file
    uint32_t size;         ///< after decompression
    std::string compression;
  };

  void readVersion() const;
  void readIndex();
  uint64_t readConnection(uint64_t offset);
  uint64_t readChunkInfo(uint64_t offset, uint64_t index_offset);
  uint64_t readChunkIndex(uint64_t offset, uint64_t index_offset);
  Chunk readChunk(uint64_t offset, uint64_t index_offset) const;
  uint32_t connectionOf(uint32_t id, uint64_t offset) const;
  internal::BagBytes* decompressed(uint32_t chunk);

  const std::string path_;
  const std::unique_ptr<internal::BagFile> file_;
  std::vector<Connection> connections_;
  std::map<uint32_t, uint32_t> connection_by_id_;
  std::vector<Chunk> chunks_;
  std::vector<BagEntry> entries_;  // sorted by time, then by position in the file
  std::map<std::string, std::set<std::string>> topics_;
  std::unique_ptr<internal::BagBytes> decompressed_;
  std::optional<uint32_t> decompressed_chunk_;
};

}  // namespace vcharge
