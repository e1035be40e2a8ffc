//! `camlux completions` and `camlux man`: shell completions and manual pages.

use std::{
    fs, io,
    path::{Path, PathBuf},
};

use clap::CommandFactory;

use crate::{Cli, Failure, print, tell};

#[derive(clap::Args)]
#[command(after_help = "\
Example:
  camlux completions bash > ~/.local/share/bash-completion/completions/camlux")]
pub struct CompletionsArgs {
    /// Shell that reads the script
    shell: clap_complete::Shell,
}

#[derive(clap::Args)]
#[command(after_help = "\
Example:
  camlux man ~/.local/share/man/man1")]
pub struct ManArgs {
    /// Folder for camlux.1 and a page for each command
    #[arg(value_name = "FOLDER")]
    folder: PathBuf,
}

pub fn print_completions(args: &CompletionsArgs) -> Result<(), Failure> {
    let mut script = Vec::new();
    clap_complete::generate(args.shell, &mut Cli::command(), "camlux", &mut script);
    print(&String::from_utf8(script)?)
}

pub fn write_pages(args: &ManArgs) -> Result<(), Failure> {
    let folder = &args.folder;
    let cannot = |path: &Path, error: io::Error| {
        format!(
            "{}: cannot write: {error}; choose another folder",
            path.display()
        )
    };
    fs::create_dir_all(folder).map_err(|error| cannot(folder, error))?;
    let mut program = Cli::command().disable_help_subcommand(true);
    program.build();
    let commands = program.get_subcommands().cloned();
    let commands: Vec<clap::Command> = commands.collect();
    for command in [program].into_iter().chain(commands) {
        let name = command
            .get_display_name()
            .unwrap_or("camlux")
            .replace(' ', "-");
        let mut page = Vec::new();
        clap_mangen::Man::new(command.name(name.clone())).render(&mut page)?;
        let path = folder.join(format!("{name}.1"));
        fs::write(&path, page).map_err(|error| cannot(&path, error))?;
        tell(&format!("wrote   {}", path.display()));
    }
    Ok(())
}
