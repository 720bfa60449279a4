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

/// Parses the arguments and runs the command that they name; the exit status. --threads and --json are every
/// command's.
inline int run_program(const std::string& name, const std::string& purpose,
                       std::initializer_list<AddCommand> commands, int argc, char** argv) {
  return exit_status(name.c_str(), [&] {
    CLI::App app(purpose, name);
    app.set_version_flag("--version", name + " " MIRRORBAKE_VERSION);
    app.require_subcommand(1);
    app.fallthrough();
    int threads = 0;
    bool json = false;
    app.add_option("--threads", threads, "threads to use, 0 for all; no result depends on it")
        ->capture_default_str()
        ->check(CLI::Range(0, 1024));
    app.add_flag("--json", json, "print figures as JSON, one object per line");
    std::vector<std::unique_ptr<Command>> added;
    for (const AddCommand add : commands) added.push_back(add(app));
    try {
      app.parse(argc, argv);
    } catch (const CLI::ParseError& error) {
      return app.exit(error) == 0 ? 0 : 2;
    }
    const ThreadLimit limit(threads);
    set_exr_threads(thread_count());
    for (const auto& command : added) {
      if (command->wanted()) command->run(json);
    }
    return 0;
  });
}

}  // namespace mirrorbake::tool
