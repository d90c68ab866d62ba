#pragma once

#include <cstdint>
#include <string>

struct sqlite3;
struct sqlite3_stmt;

namespace vcharge {

/// One SQLite file. Every failure is an InputError that names the file.
class SqliteDatabase {
 public:
  enum class Access {
    kReadOnly,  ///< nothing is written, not even beside the file, and no journal is looked for
    kCreate     ///< without a rollback journal: for a temporary file that is thrown away if anything fails
  };

  /// `name` is what errors call the file.
  SqliteDatabase(const std::string& path, const std::string& name, Access access);
  ~SqliteDatabase();
  SqliteDatabase(const SqliteDatabase&) = delete;
  SqliteDatabase& operator=(const SqliteDatabase&) = delete;

  /// Statements without results, separated by ';'.
  void execute(const std::string& sql);
  /// InputError with SQLite's reason, and the system's where there is one.
  [[noreturn]] void fail() const;

 private:
  friend class SqliteStatement;
  void close();

  std::string name_;
  Access access_;
  sqlite3* handle_ = nullptr;
};

/// A prepared statement; the database must outlive it. Parameters and columns count from 0.
class SqliteStatement {
 public:
  SqliteStatement(const SqliteDatabase& database, const char* sql);
  ~SqliteStatement();
  SqliteStatement(const SqliteStatement&) = delete;
  SqliteStatement& operator=(const SqliteStatement&) = delete;

  void bind(int parameter, int64_t value);
  void bind(int parameter, double value);
  void bind(int parameter, const std::string& text);
  /// The bytes must live until the next step().
  void bindBlob(int parameter, const void* data, size_t size);
  void bindNull(int parameter);

  /// True while there is a row.
  bool step();
  /// For a statement without rows: executes it and makes it ready for the next parameters.
  void run();

  int64_t integer(int column) const;
  double number(int column) const;
  std::string text(int column) const;
  bool isNull(int column) const;
  /// Valid until the next step(); null where empty.
  const void* blob(int column) const;
  size_t blobSize(int column) const;

 private:
  void check(int result) const;

  const SqliteDatabase& database_;
  sqlite3_stmt* handle_ = nullptr;
};

}  // namespace vcharge
