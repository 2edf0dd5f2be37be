//! The same work for a scheduler that exists: Slurm, Kubernetes, GNU parallel.
//!
//! A part of a stage is `pneuma fleet run --stage STAGE --part N/OF`: it does every OF-th job that is
//! not done yet. A part that is run twice, or beside another of the same, finds what is done.

use super::plan::Plan;
use std::path::Path;

/// The stages in their order; each waits for the one before.
pub const STAGES: [&str; 3] = ["reference", "night", "verdict"];

/// A script that submits all stages to Slurm as arrays of so many parts, each after the last.
pub fn slurm(plan: &Path, program: &Path, parts: usize) -> String {
    let (plan, program) = (quoted(plan), quoted(program));
    let mut script = String::from(
        "#!/bin/sh\n# Submits a fleet's work to Slurm; submitted again it finds what is done.\nset -eu\nafter=\"\"\n",
    );
    for stage in STAGES {
        let command = format!(
            "{program} fleet run --plan {plan} --stage {stage} --at-once 1 --part $SLURM_ARRAY_TASK_ID/{parts}"
        );
        script += &format!(
            "job=$(sbatch --parsable --job-name=pneuma-{stage} --array=1-{parts} --ntasks=1 --cpus-per-task=1 --requeue $after --wrap={})\necho \"{stage}: job $job\"\nafter=\"--dependency=afterany:$job\"\n",
            shell_quoted(&command)
        );
    }
    script
}

/// Lines for GNU parallel (`sh` runs them too), a stage after the other.
pub fn parallel(plan: &Path, program: &Path, parts: usize) -> String {
    let (plan, program) = (quoted(plan), quoted(program));
    let line = |stage: &str| {
        format!(
            "parallel {program} fleet run --plan {plan} --stage {stage} --at-once 1 --part {{}}/{parts} ::: $(seq {parts})\n"
        )
    };
    STAGES.iter().map(|stage| line(stage)).collect()
}

/// A Kubernetes Job of so many parts for one stage; plan, rigs and recordings on a volume that all see.
pub fn kubernetes(plan: &Path, image: &str, stage: &str, parts: usize) -> String {
    let folder = plan.parent().unwrap_or(Path::new("."));
    let text = |path: &Path| serde_json::Value::from(path.to_string_lossy()).to_string();
    format!(
        r#"apiVersion: batch/v1
kind: Job
metadata:
  name: pneuma-fleet-{stage}
spec:
  completionMode: Indexed
  completions: {parts}
  parallelism: {parts}
  backoffLimitPerIndex: 3
  template:
    spec:
      restartPolicy: Never
      containers:
        - name: pneuma
          image: {image}
          command: ["sh", "-c", "exec pneuma fleet run --plan \"$PLAN\" --stage {stage} --at-once 1 --part $((JOB_COMPLETION_INDEX + 1))/{parts}"]
          env:
            - {{ name: PLAN, value: {plan} }}
          resources:
            requests: {{ cpu: "1", memory: 1Gi }}
          volumeMounts:
            - {{ name: fleet, mountPath: {folder} }}
      volumes:
        - name: fleet
          persistentVolumeClaim: {{ claimName: pneuma-fleet }}
"#,
        plan = text(plan),
        folder = text(folder),
        image = serde_json::Value::from(image),
    )
}

/// How many jobs there are before any verdict.
pub fn jobs(plan: &Plan) -> usize {
    plan.axes.len()
        + plan
            .axes
            .iter()
            .map(|axis| axis.nights.len())
            .sum::<usize>()
}

fn quoted(path: &Path) -> String {
    shell_quoted(&path.to_string_lossy())
}

/// A word of a shell, whatever is in it.
fn shell_quoted(text: &str) -> String {
    format!("'{}'", text.replace('\'', "'\\''"))
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn prop_a_shell_reads_back_what_was_quoted() {
        for text in ["plain", "a b", "it's", "$(rm)", "\"x\"", "'"] {
            let said = std::process::Command::new("sh")
                .arg("-c")
                .arg(format!("printf %s {}", shell_quoted(text)))
                .output()
                .unwrap();
            assert_eq!(String::from_utf8(said.stdout).unwrap(), text);
        }
    }

    #[test]
    fn val_slurm_stages_wait_for_each_other() {
        let script = slurm(Path::new("/fleet/it's/plan.json"), Path::new("pneuma"), 4);
        assert_eq!(script.matches("sbatch").count(), 3);
        assert_eq!(script.matches("--array=1-4").count(), 3);
        assert!(script.contains("afterany"));
        let status = std::process::Command::new("sh")
            .arg("-n")
            .arg("-c")
            .arg(&script)
            .status();
        assert!(status.unwrap().success());
    }
}
