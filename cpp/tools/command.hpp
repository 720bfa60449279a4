#pragma once

#include <CLI/CLI.hpp>

#include <initializer_list>
#include <memory>
#include <string>
#include <vector>

#include "mirrorbake/core/parallel.hpp"
#include "mirrorbake/image/image_io.hpp"
#include "tool.hpp"

/// Programs that are made of commands, each in a file of its own.
namespace mirrorbake::tool {

/// A command: its constructor adds its options to the program, and it runs if it was asked for.
class Command {
 public:
  explicit Command(CLI::App* app) : app_(app) {}
  Command(const Command&) = delete;
  Command& operator=(const Command&) = delete;
  virtual ~Command() = default;
  bool wanted() const { return app_->parsed(); }
  virtual void run(bool json) const = 0;

 private:
  CLI::App* app_;
};

using AddCommand = std::unique_ptr<Command> (*)(CLI::App&);

/// Wrong usage is one line, as other errors are.
inline std::string usage_error(const CLI::App* app, const CLI::Error& error) {
  return app->get_name() + ": " + error.what() + "; --help explains\n";
}

/// Parses the arguments of a program, which get --threads and --json, and calls body(json); the exit status.
template <typename Body>
int run_parsed(CLI::App& app, const char* json_text, int argc, char** argv, const Body& body) {
  app.set_version_flag("--version", app.get_name() + " " MIRRORBAKE_VERSION);
  app.failure_message(usage_error);
  int threads = 0;
  bool json = false;
  app.add_option("--threads", threads, "threads to use, 0 for all; no result depends on it")
      ->capture_default_str()
      ->check(CLI::Range(0, 1024));
  app.add_flag("--json", json, json_text);
  try {
    app.parse(argc, argv);
  } catch (const CLI::ParseError& error) {
    return app.exit(error) == 0 ? 0 : 2;
  }
  const ThreadLimit limit(threads);
  set_exr_threads(thread_count());
  body(json);
  return 0;
}

/// Parses the arguments and runs the command that they name; the exit status. --threads and --json are every
/// command's.
inline int run_program(const std::string& name, const std::string& purpose,
                       std::initializer_list<AddCommand> commands, int argc, char** argv) {
  return exit_status(name.c_str(), [&] {
    CLI::App app(purpose, name);
    app.require_subcommand(1);
    app.fallthrough();
    std::vector<std::unique_ptr<Command>> added;
    for (const AddCommand add : commands) added.push_back(add(app));
    return run_parsed(app, "print figures as JSON, one object per line", argc, argv, [&](bool json) {
      for (const auto& command : added) {
        if (command->wanted()) command->run(json);
      }
    });
  });
}

}  // namespace mirrorbake::tool
