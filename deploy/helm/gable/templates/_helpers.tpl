{{- define "gable.name" -}}
{{- printf "%s" .Release.Name | trunc 50 | trimSuffix "-" -}}
{{- end }}

{{- define "gable.labels" -}}
app.kubernetes.io/name: gable
app.kubernetes.io/instance: {{ .Release.Name }}
app.kubernetes.io/version: {{ .Chart.AppVersion | quote }}
app.kubernetes.io/managed-by: {{ .Release.Service }}
helm.sh/chart: {{ printf "%s-%s" .Chart.Name .Chart.Version }}
{{- end }}

{{- define "gable.selector" -}}
app.kubernetes.io/name: gable
app.kubernetes.io/instance: {{ .Release.Name }}
{{- end }}

{{- define "gable.pod" -}}
automountServiceAccountToken: false
securityContext:
  runAsNonRoot: true
  runAsUser: 10001
  runAsGroup: 10001
  fsGroup: 10001
  seccompProfile: { type: RuntimeDefault }
{{- with .Values.imagePullSecrets }}
imagePullSecrets: {{- toYaml . | nindent 2 }}
{{- end }}
{{- end }}

{{- define "gable.container" -}}
image: "{{ .Values.image.repository }}:{{ .Values.image.tag | default .Chart.AppVersion }}"
imagePullPolicy: {{ .Values.image.pullPolicy }}
securityContext:
  allowPrivilegeEscalation: false
  readOnlyRootFilesystem: true
  capabilities: { drop: [ALL] }
envFrom:
  - secretRef: { name: {{ .Values.existingSecret }} }
env:
  - { name: GABLE_STORE, value: {{ .Values.store.place | quote }} }
  - { name: AWS_REGION, value: {{ .Values.store.region | quote }} }
  {{- with .Values.store.endpoint }}
  - { name: AWS_ENDPOINT_URL, value: {{ . | quote }} }
  {{- end }}
  {{- with .Values.traces.endpoint }}
  - { name: OTEL_EXPORTER_OTLP_ENDPOINT, value: {{ . | quote }} }
  {{- end }}
volumeMounts:
  - { name: data, mountPath: /cities }
  - { name: temporary, mountPath: /tmp }
  {{- if .Values.meshes.existingClaim }}
  - { name: meshes, mountPath: /meshes, readOnly: true }
  {{- end }}
{{- end }}

{{- define "gable.meshes" -}}
{{- with .Values.meshes.existingClaim }}
- name: meshes
  persistentVolumeClaim: { claimName: {{ . }}, readOnly: true }
{{- end }}
{{- end }}

{{- define "gable.roots" -}}
{{- range .Values.sourceRoots }}
- --source-root={{ . }}
{{- end }}
{{- end }}
